"""Quasi-static equilibrium of the block under its plate: globalised Newton, bordered by the plate.

Unknowns are the nodal displacements and the plate's vertical displacement, which is that of all
nodes on the plate; the last equation is that the plate carries the given force, or that it stays
where it is.

Each iteration goes along a change that is exact for the present contact, and uses the rubber's
factors of an earlier tangent (`tangent`). It is accepted, or leaps past a kink of the contact, or
asks for new factors, or is an error. PETSc's SNES counts iterations to lag its Jacobian, and its
line search looks at the residual's norm: in that way the scenes of `cases/` took 1.5 to 4 times the
tangents.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.rubber.beside_plate import lift_of
from iceslide_fem.rubber.contact import (
    ContactState,
    Traction,
    contact_forces,
    contact_state,
    contact_tangent,
)
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody
from iceslide_fem.rubber.tangent import Tangent

MAX_ITERATIONS = 60
ROUNDING = 1e-11  # of the plate's force, which rounding of the elastic forces may leave
MOST_TANGENTS = 8  # where that many do not help, a shorter step costs less than more of them
# So many iterations with kept factors are worth it, by dimension: new ones cost as much as five in
# a slice, twenty in a block, but with new ones the next steps take fewer, too. And so many more for
# each tangent that a solve has had: with new ones at every iteration slices go back and forth over
# points that touch.
PATIENCE = {2: (3, 3), 3: (7, 0)}
# What the contact may leave in a change by kept factors, of the residual to reach.
REST = 0.2
# Of a change by the factors of where it starts; by those of an earlier place of the same solve,
# which would creep; one by an earlier solve's is taken whole or not at all.
DAMPINGS = tuple(0.5**n for n in range(8))
OLDER_DAMPINGS = DAMPINGS[1:3]
# Where a change does not shorten the next one, a point of the contact touches down or lifts off on
# the way: a full step leads past it (watchdog), with kept factors if the next change is lengthened
# by no more than the first of these, or the second where the residual falls, with new ones if no
# damping helps. So many with the same factors, and of the latter in one solve.
STRIDE, LONG_STRIDE, LEAPS = 2.0, 30.0, 4
# Where full steps go back and forth over what makes so few points touch or lift, the equilibrium is
# where one hardly touches, with its shear half faded in: the step ends there, after this share of
# the way on which the point touches.
CHATTERING, TOUCH = 3, 0.03

# Tangential traction on the rubber of the contact pressure (f, q) and displacement (f, q, d-1).
TractionLaw = Callable[[Array, Array], Traction]


class Solution(NamedTuple):
    """Newton iterations and tangents that one equilibrium took, the residual left (N), and what
    the plate carries (N).
    """

    iterations: int
    tangents: int
    residual: float
    force: float


class Trial(NamedTuple):
    """Where a damped change leads: whether it is accepted, the residual's norm (N) there, the next
    change by the same tangent and its length over this one's; `finite` is the first damping that
    turned no element inside out, if any.

    With the tolerance reached there is no next one. Accepted is what makes the next change shorter
    (the natural monotonicity test of P. Deuflhard, Newton Methods for Nonlinear Problems, Springer
    2004, ch. 3), or what reaches the tolerance.
    """

    accepted: bool
    damping: float
    size: float
    contraction: float
    following: Array | None
    finite: float | None


class Equilibrium:
    """Solves for the displacements of `rubber` and the plate.

    force (N; N/m in a slice; half of it in a half model) and the traction law are given per
    solve; the tangent's factors are kept from one solve to the next.
    """

    def __init__(
        self,
        rubber: HyperelasticBody,
        surface: ContactSurface,
        penalty: float,
        prefix: str = "rubber_",
        patience: int | None = None,
    ) -> None:
        """`penalty` in Pa/m; `prefix` selects PETSc options of the linear solver.

        A tangent is kept if `patience` iterations like the last one, by default PATIENCE, would
        reach the tolerance; 0 is full Newton.
        """
        self.rubber, self.surface, self.penalty = rubber, surface, penalty
        self._tangent = Tangent(rubber, surface, prefix)
        self._residual = rubber.create_vector()
        self._plate_imbalance: float | None = 0.0  # None: the plate is held
        self._carried = 0.0  # by the plate, N
        by_dimension = PATIENCE[rubber.mesh.geometry.dim]
        self._patience, self._more_patience = by_dimension if patience is None else (patience, 0)
        self._enough = 0.0
        self._has_tangent = False
        self._contact: ContactState  # where the imbalance was last found, and its traction
        self._traction: Traction
        self._linearised: ContactState | None = None  # where the tangent was

    def solve(self, force: float | None, law: TractionLaw, tolerance: float) -> Solution:
        """Find equilibrium from the present displacements; plate force `force`, downwards.

        With None the plate stays where the displacements have it, and carries what it does.
        `tolerance` (N) is the norm of the residual to reach, or what rounding leaves of it. Raises
        NotConverged, with the displacements at the last iterate: the caller restores what it had.
        """
        values = self.rubber.u.x.array
        tolerance = max(tolerance, ROUNDING * (force or 0.0), self.rubber.force_rounding())
        self._enough = REST * tolerance
        tangents = leaps = strides = 0
        size = smallest = self._imbalance(force, law)
        load = self._carried if force is None else force
        change: Array | None = None  # and what the factors alone have found for it
        found: Array | None = None
        safe, fresh = values.copy(), False  # where to go back to, and whether the factors are of it
        gap = self._contact.gap  # where the last change started
        for iteration in range(MAX_ITERATIONS):
            if size <= tolerance:
                return Solution(iteration, tangents, size, self._carried)
            smallest = min(size, smallest)
            if change is None:
                change = found = self._kept_direction()
            if change is None and tangents == MOST_TANGENTS:
                break
            if change is None:
                change = found = self._new_direction(size)
                tangents += 1
                safe, fresh, strides = values.copy(), True, 0
            start, before, gap = values.copy(), gap, self._contact.gap
            trial = self._trial(force, law, tolerance, change, DAMPINGS[:1])
            stride = LONG_STRIDE if trial.size < size else STRIDE
            if not trial.accepted and (touching := self._touching(before, gap)):
                values[:], stride = start, LONG_STRIDE
                trial = self._trial(force, law, tolerance, change, touching)
            if not trial.accepted and strides < LEAPS and trial.contraction < stride:
                size, change, strides = trial.size, trial.following, strides + 1
                found = change
                continue
            if not trial.accepted and tangents:
                values[:] = start
                dampings = DAMPINGS[1:] if fresh else OLDER_DAMPINGS
                trial = self._trial(force, law, tolerance, change, dampings)
            if trial.accepted:
                size, safe, fresh = trial.size, values.copy(), False
                patience = self._patience + tangents * self._more_patience
                soon = size * trial.contraction**patience <= tolerance
                self._has_tangent = (soon or trial.damping < 1.0) and not self._tangent.worn
                following = trial.following if self._has_tangent else None
                if following is not None and found is not None and trial.damping == 1.0:
                    change = self._along_secant(values - start, found, following)
                else:
                    change = following
                found = following
                continue
            values[:] = safe
            if fresh and leaps < LEAPS and trial.finite is not None:
                values += trial.finite * change
                leaps += 1
            elif fresh:
                raise NotConverged(_stuck(smallest, load))
            self._has_tangent = False
            size, change = self._imbalance(force, law), None
        raise NotConverged(_stuck(smallest, load))

    def _trial(
        self,
        force: float | None,
        law: TractionLaw,
        tolerance: float,
        change: Array,
        dampings: tuple[float, ...],
    ) -> Trial:
        """Go along `change` by the first of `dampings` that is accepted, or the last of them."""
        values, length = self.rubber.u.x.array, self._tangent.length(change)
        start, finite = values.copy(), None
        for damping in dampings:
            values[:] = start + damping * change
            size = self._imbalance(force, law)
            if finite is None and np.isfinite(size):
                finite = damping
            if size <= tolerance:
                return Trial(True, damping, size, 0.0, None, finite)
            following = self._direction()
            contraction = self._tangent.length(following) / length if length > 0.0 else np.inf
            accepted = contraction <= 1.0 - 0.25 * damping  # not if NaN
            if accepted:
                break
        return Trial(accepted, damping, size, contraction, following, finite)

    def _along_secant(self, moved: Array, before: Array, after: Array) -> Array:
        """The change that the factors find `after` another has `moved` the nodes, in place of the
        one `before`, by the secant through both: factors of an earlier tangent alone would leave
        the same share of what is missing each time (D. G. Anderson, J. ACM 12 (1965) 547, of depth
        1). Collective.
        """
        turned, (across, along) = after - before, self._tangent.products(after - before, after)
        return after - along / across * (moved + turned) if across > 0.0 else after

    def _touching(self, before: Array, gap: Array) -> tuple[float, ...]:
        """Dampings of a change from `gap` (m) with which points just touch that the whole change
        makes touch or lift; none unless it undoes what the change from `before` did. Collective.
        """
        touches = self._contact.gap < 0.0
        chattering = (gap < 0.0) != touches
        old, new = gap[chattering], self._contact.gap[chattering]
        crossing = old / (old - new)
        lands = np.where(new < 0.0, crossing + TOUCH * (1.0 - crossing), crossing * (1.0 - TOUCH))
        undone = bool(((before < 0.0) == touches).all())
        everywhere = self.surface.comm.allgather((undone, lands))
        dampings = np.sort(np.concatenate([one for _, one in everywhere]))
        few = dampings.size <= CHATTERING and all(whole for whole, _ in everywhere)
        return tuple(dampings) if few else ()

    def _kept_direction(self) -> Array | None:
        """Newton's change by the tangent of an earlier solve, if it is there and gives one."""
        if not self._has_tangent:
            return None
        change = self._direction()
        return change if 0.0 < self._tangent.length(change) < np.inf else None

    def _new_direction(self, size: float) -> Array:
        """Newton's change by the tangent at the present displacements, with a residual `size`."""
        if not np.isfinite(size):
            raise NotConverged("elements of the rubber are inverted")
        self._linearise()
        change = self._direction()
        if not 0.0 < self._tangent.length(change) < np.inf:
            raise NotConverged("the tangent is singular")
        return change

    def forget(self) -> None:
        """Drop the kept tangent (after the displacements were restored from far away)."""
        self._has_tangent = False

    def lower_plate(self, depth: float) -> None:
        """Move the plate downwards by `depth` (m), what is below it by its share of the height."""
        u, rubber = self.rubber.displacements, self.rubber
        z = rubber.space.tabulate_dof_coordinates()[:, u.shape[1] - 1]
        top = rubber.mesh.comm.allreduce(float(z.max(initial=0.0)), op=MPI.MAX)
        u[:, -1] -= depth * z / top
        u[rubber.plate, -1] = -self.plate_displacement()

    def plate_displacement(self) -> float:
        """Downward displacement of the plate, m. Collective."""
        rubber = self.rubber
        return -lift_of(rubber.plate, rubber.displacements, rubber.mesh.comm)

    def _imbalance(self, force: float | None, law: TractionLaw) -> float:
        """Norm of internal minus external forces (N); leaves the residual and the plate's."""
        u, residual, surface = self.rubber.displacements, self._residual, self.surface
        self.rubber.internal_forces(residual)
        self._contact = contact_state(surface, u, self.penalty)
        self._traction = law(self._contact.pressure, surface.displacements(u)[..., :-1])
        forces = contact_forces(surface, self._contact, self._traction)
        with residual.localForm() as local:
            surface.scatter(-forces, local.array.reshape(u.shape))
        compat.sum_ghosts(residual)
        self._carried = self.rubber.plate_reaction - self._tangent.imbalance(residual)
        self._plate_imbalance = None if force is None else force - self._carried
        return self._tangent.size(residual, self._plate_imbalance)

    def _contact_tangent(self) -> Array:
        """Derivatives of the contact's forces where the imbalance was last found."""
        u = self.rubber.displacements
        return contact_tangent(self.surface, u, self.penalty, self._contact, self._traction)

    def _linearise(self) -> None:
        """Assemble and factorise the tangent where the imbalance was last found."""
        self._has_tangent = False
        self._tangent.factorise(self._contact_tangent())
        self._has_tangent, self._linearised = True, self._contact

    def _direction(self) -> Array:
        """Newton's change from the kept factors, with the contact as it is."""
        if self._contact is not self._linearised:
            self._tangent.touch(self._contact_tangent())
        try:
            return self._tangent.change(self._residual, self._plate_imbalance, self._enough)
        except NotConverged:
            self._has_tangent = False
            raise


def _stuck(residual: float, force: float) -> str:
    """Why there is no equilibrium, from the smallest residual (N) on the way to `force` (N)."""
    if not residual < force:
        return "elements of the rubber turn inside out on the way to it"
    return f"Newton's method leaves {residual / force:.1g} of the load unbalanced"
