"""Globalised Newton's method with a lagged Jacobian, for a contact problem.

Each iteration goes along a change that is exact for the present contact, and uses the rubber's
factors of an earlier Jacobian (`tangent`). In this order it is tried as

1. a full step, accepted by the natural monotonicity test: the next change by the same factors is
   shorter (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, ch. 3);
2. a step that ends where a point just touches, if the full one undoes what the step before did;
3. a watchdog step: a full step that makes the next change somewhat longer leads past a kink, where
   a point touches down or lifts off;
4. a damped step;
5. a step by a new Jacobian from the last accepted iterate;
6. an escape: the largest step by a new Jacobian that turns no element inside out.

The Jacobian is made anew, too, where the last step tells that so many more with it would not reach
the tolerance.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged

MAX_ITERATIONS = 60
MOST_JACOBIANS = 8  # where that many do not help, a shorter step costs less than more of them
# Lag of the Jacobian, in iterations, and how much longer it is for each Jacobian that a solve has
# had, by dimension: a new one costs as much as five iterations in a slice, twenty in a block, but
# the next steps take fewer with it, too. With a new one at every iteration slices go back and forth
# over points that touch.
LAG = {2: (3, 3), 3: (7, 0)}
# Dampings by a Jacobian of where the change starts; by one of an earlier place of the same solve.
# A change by an earlier solve's is taken whole or not at all.
DAMPINGS = tuple(0.5**n for n in range(8))
OLDER_DAMPINGS = DAMPINGS[1:3]
# A watchdog step may lengthen the next change by so much, or by the second where the residual
# falls; so many with the same factors, and so many escapes in a solve.
WATCHDOG, LONG_WATCHDOG, MOST_WATCHDOGS, MOST_ESCAPES = 2.0, 30.0, 4, 4


class Solution(NamedTuple):
    """Iterations and Jacobians that one equilibrium took, the residual left (N), and what the plate
    carries (N).
    """

    iterations: int
    jacobians: int
    residual: float
    force: float


class Equations(Protocol):
    """What Newton's method asks of a problem. All is collective."""

    @property
    def values(self) -> Array:
        """Unknowns of this rank, m; changed in place."""

    def residual(self) -> float:
        """Norm of the residual (N) at the present values."""

    def linearise(self) -> None:
        """Make a new Jacobian and its factors at the present values."""

    def change(self) -> Array:
        """Newton's change by the kept factors, with the contact as it is."""

    def length(self, change: Array) -> float:
        """Norm of a change, m."""

    @property
    def carried(self) -> float:
        """By the plate, N, at the last residual."""

    @property
    def stale(self) -> bool:
        """Whether new factors would pay."""

    @property
    def gap(self) -> Array:
        """Of the contact points, m."""

    def landings(self, before: Array, gap: Array) -> tuple[float, ...]:
        """Fractions of the last change, from `gap`, with which a point just touches; none unless
        it undoes the change from `before`.
        """


class Trial(NamedTuple):
    """Where a damped change leads: whether it is accepted, the residual's norm (N), the next change
    by the same factors (None within the tolerance) and its length over this one's; finite: the
    first damping that turns no element inside out, if any.
    """

    accepted: bool
    damping: float
    size: float
    contraction: float
    following: Array | None
    finite: float | None


class Newton:
    """One solve of the `equations` to a `tolerance` (N); `kept`: whether there is a Jacobian."""

    def __init__(
        self, equations: Equations, tolerance: float, lag: tuple[int, int], kept: bool
    ) -> None:
        """`lag`: of the Jacobian, and more for each that the solve has had (iterations)."""
        self._equations, self._tolerance, self._lag = equations, tolerance, lag
        self.kept, self.jacobians = kept, 0
        self._watchdogs = self._escapes = 0
        self._safe, self._fresh = equations.values.copy(), False

    def solve(self, force: float | None) -> tuple[int, float]:
        """Iterations, and the residual left (N); `force` (N) of the plate, None if it is held.

        Raises NotConverged, with the values at the last iterate.
        """
        equations, values = self._equations, self._equations.values
        size = smallest = equations.residual()
        load = equations.carried if force is None else force  # of messages
        change: Array | None = None
        gap = equations.gap
        for iteration in range(MAX_ITERATIONS):
            if size <= self._tolerance:
                return iteration, size
            smallest = min(size, smallest)
            change = self._kept_change() if change is None else change
            if change is None and self.jacobians == MOST_JACOBIANS:
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
                trial = self._trial(start, change, DAMPINGS[1:] if self._fresh else OLDER_DAMPINGS)
            if trial.accepted:
                size, change = trial.size, self._after_accepted(trial)
            elif self._fresh and (self._escapes == MOST_ESCAPES or trial.finite is None):
                break
            else:
                self._go_back(change, trial)
                size, change = equations.residual(), None
        raise NotConverged(_stuck(smallest, load))

    def _trial(self, start: Array, change: Array, dampings: tuple[float, ...]) -> Trial:
        """Go from `start` along `change` by the first damping that is accepted, or the last."""
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
            accepted = contraction <= 1.0 - 0.25 * damping  # not if NaN
            if accepted:
                break
        return Trial(accepted, damping, size, contraction, following, finite)

    def _after_accepted(self, trial: Trial) -> Array | None:
        """The next change, None where it wants a new Jacobian."""
        self._safe, self._fresh = self._equations.values.copy(), False
        lag = self._lag[0] + self.jacobians * self._lag[1]
        soon = trial.size * trial.contraction**lag <= self._tolerance
        self.kept = (soon or trial.damping < 1.0) and not self._equations.stale
        return trial.following if self.kept else None

    def _go_back(self, change: Array, trial: Trial) -> None:
        """To the last accepted iterate for a new Jacobian, or past it where that one was new."""
        self._equations.values[:] = self._safe
        if self._fresh and trial.finite is not None:
            self._equations.values[:] += trial.finite * change
            self._escapes += 1
        self.kept = False

    def _kept_change(self) -> Array | None:
        """The change by factors of an earlier solve, if there are any that give one."""
        if not self.kept:
            return None
        change = self._equations.change()
        return change if 0.0 < self._equations.length(change) < np.inf else None

    def _new_change(self, size: float) -> Array:
        """The change by a new Jacobian, where the residual has this `size` (N)."""
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
    """Why there is no equilibrium, from the smallest residual (N) on the way to `force` (N)."""
    if not residual < force:
        return "elements of the rubber turn inside out on the way to it"
    return f"Newton's method leaves {residual / force:.1g} of the load unbalanced"
