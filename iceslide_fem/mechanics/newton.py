"""Globalised Newton's method with a lagged Jacobian, for a contact problem.

Each change is exact for the present contact, and uses factors of an earlier Jacobian for the rubber
(`tangent`). An iteration tries, in this order:

1. a full step, accepted by the natural monotonicity test: the next change by the same factors is
   shorter (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, ch. 3);
2. a step to the touchdown of a point, if the full step undoes the previous one;
3. a watchdog step: a full step with a somewhat longer next change, which may pass a kink where a
   point touches down or lifts off;
4. a damped step;
5. a step by a new Jacobian from the last accepted iterate;
6. an escape: the largest step by a new Jacobian without inverted elements.

The Jacobian is also renewed if `lag` more iterations at the last rate miss the tolerance. `QUICK`
solves give up early: on a path of loads a shorter step is cheaper. In time a block may snap to
another equilibrium, however short the step is. `BRIEF` solves escape, but do not cycle for long.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged

MAX_ITERATIONS = 60
# Lag of the Jacobian in iterations, and its growth with each Jacobian of a solve, by dimension. A
# new Jacobian costs as much as five iterations in a slice and twenty in a block, but the next time
# steps also profit. With a new one at every iteration, slices cycle over touching points.
LAG = {2: (3, 3), 3: (7, 0)}
# Dampings with a Jacobian of the present iterate, and with one of an earlier iterate of this solve.
# With a Jacobian of an earlier solve only the full step is tried.
DAMPINGS = tuple(0.5**n for n in range(8))
OLDER_DAMPINGS = DAMPINGS[1:3]
# Largest growth of the next change in a watchdog step, and with a falling residual; number of
# watchdog steps with the same factors.
WATCHDOG, LONG_WATCHDOG, MOST_WATCHDOGS = 2.0, 30.0, 4


class Patience(NamedTuple):
    """Largest numbers of Jacobians, of dampings, and of escapes in a solve."""

    jacobians: int
    dampings: int
    escapes: int


PATIENT, BRIEF, QUICK = Patience(8, 8, 4), Patience(4, 8, 3), Patience(4, 4, 0)


class Solution(NamedTuple):
    """Iterations and Jacobians of one equilibrium, final residual (N), and plate force (N)."""

    iterations: int
    jacobians: int
    residual: float
    force: float


class Equations(Protocol):
    """The equations, as Newton's method uses them. All methods are collective."""

    @property
    def values(self) -> Array:
        """Unknowns of this rank, m; changed in place."""

    def residual(self) -> float:
        """Norm of the residual (N) at the present values."""

    def linearise(self) -> None:
        """Assemble and factorise a new Jacobian at the present values."""

    def change(self) -> Array:
        """Newton step by kept factors, with the present contact."""

    def length(self, change: Array) -> float:
        """Norm of a change, m."""

    @property
    def carried(self) -> float:
        """Plate force at the last residual, N."""

    @property
    def stale(self) -> bool:
        """Whether a new factorisation would reduce the cost."""

    @property
    def gap(self) -> Array:
        """Gap of the contact points, m."""

    def landings(self, before: Array, gap: Array) -> tuple[float, ...]:
        """Fractions of the last change, from `gap`, at which a point just touches.

        Empty unless it undoes the change from the gap `before`.
        """


class Trial(NamedTuple):
    """Result of a damped change.

    It has: whether it is accepted; the residual's norm (N); the next change by the same factors
    (None within the tolerance) and its length over this one's; finite: the first damping without
    inverted elements, if any.
    """

    accepted: bool
    damping: float
    size: float
    contraction: float
    following: Array | None
    finite: float | None


class Newton:
    """One solve of `equations` to a `tolerance` (N); kept: whether a Jacobian exists."""

    def __init__(
        self,
        equations: Equations,
        tolerance: float,
        lag: tuple[int, int],
        kept: bool,
        patience: Patience = PATIENT,
    ) -> None:
        """`lag`: of the Jacobian in iterations, and its growth with each Jacobian of the solve."""
        self._equations, self._tolerance, self._lag = equations, tolerance, lag
        self._most = patience
        self.kept, self.jacobians = kept, 0
        self._watchdogs = self._escapes = 0
        self._safe, self._fresh = equations.values.copy(), False

    def solve(self, force: float | None) -> tuple[int, float]:
        """Iterations and final residual (N); force: of the plate, N, None if held.

        Raises NotConverged; the values are then those of the last iterate.
        """
        equations, values = self._equations, self._equations.values
        size = smallest = equations.residual()
        load = equations.carried if force is None else force  # for messages
        change: Array | None = None
        gap = equations.gap
        for iteration in range(MAX_ITERATIONS):
            if size <= self._tolerance:
                return iteration, size
            smallest = min(size, smallest)
            change = self._kept_change() if change is None else change
            if change is None and self.jacobians == self._most.jacobians:
                break
            change = self._new_change(size) if change is None else change
            start, before, gap = values.copy(), gap, equations.gap
            trial = self._trial(start, change, DAMPINGS[:1])
            longer = LONG_WATCHDOG if trial.size < size else WATCHDOG
            if not trial.accepted and (landings := equations.landings(before, gap)):
                trial, longer = self._trial(start, change, landings), LONG_WATCHDOG
            if (
                not trial.accepted
                and self._watchdogs < MOST_WATCHDOGS
                and (trial.contraction < longer)
            ):
                self._watchdogs += 1
                size, change = trial.size, trial.following
                continue
            if not trial.accepted and self.jacobians:
                dampings = DAMPINGS[1 : self._most.dampings] if self._fresh else OLDER_DAMPINGS
                trial = self._trial(start, change, dampings)
            if trial.accepted:
                size, change = trial.size, self._after_accepted(trial)
            elif self._fresh and (self._escapes == self._most.escapes or trial.finite is None):
                break
            else:
                self._go_back(change, trial)
                size, change = equations.residual(), None
        raise NotConverged(_stuck(smallest, load))

    def _trial(self, start: Array, change: Array, dampings: tuple[float, ...]) -> Trial:
        """Step from `start` along `change` with the first accepted damping, or the last one."""
        equations, length, finite = self._equations, self._equations.length(change), None
        for damping in dampings:
            equations.values[:] = start + damping * change
            size = equations.residual()
            if finite is None and np.isfinite(size):
                finite = damping
            if size <= self._tolerance:
                return Trial(True, damping, size, 0.0, None, finite)
            following = equations.change()
            contraction = equations.length(following) / length if length > 0.0 else np.inf
            accepted = contraction <= 1.0 - 0.25 * damping  # False if NaN
            if accepted:
                break
        return Trial(accepted, damping, size, contraction, following, finite)

    def _after_accepted(self, trial: Trial) -> Array | None:
        """The next change; None if a new Jacobian is needed."""
        self._safe, self._fresh = self._equations.values.copy(), False
        lag = self._lag[0] + self.jacobians * self._lag[1]
        soon = trial.size * trial.contraction**lag <= self._tolerance
        self.kept = (soon or trial.damping < 1.0) and not self._equations.stale
        return trial.following if self.kept else None

    def _go_back(self, change: Array, trial: Trial) -> None:
        """Return to the last accepted iterate for a new Jacobian; escape if that one was new."""
        self._equations.values[:] = self._safe
        if self._fresh and trial.finite is not None:
            self._equations.values[:] += trial.finite * change
            self._escapes += 1
        self.kept = False

    def _kept_change(self) -> Array | None:
        """The change by factors of an earlier solve; None if there are none or they fail."""
        if not self.kept:
            return None
        change = self._equations.change()
        return change if 0.0 < self._equations.length(change) < np.inf else None

    def _new_change(self, size: float) -> Array:
        """The change by a new Jacobian at a residual of `size` (N)."""
        if not np.isfinite(size):
            raise NotConverged("elements of the rubber are inverted")
        self.kept = False
        self._equations.linearise()
        self.kept = True
        self.jacobians += 1
        self._safe, self._fresh, self._watchdogs = self._equations.values.copy(), True, 0
        change = self._equations.change()
        if not 0.0 < self._equations.length(change) < np.inf:
            raise NotConverged("the tangent is singular")
        return change


def _stuck(residual: float, force: float) -> str:
    """Why there is no equilibrium; residual: smallest one (N); force: plate force (N)."""
    if not residual < force:
        return "elements of the rubber turn inside out on the way to it"
    return f"Newton's method leaves {residual / force:.1g} of the load unbalanced"
