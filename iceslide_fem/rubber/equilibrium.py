"""Quasi-static equilibrium of the block under its plate: globalised Newton, bordered by the plate.

Unknowns are the nodal displacements and the plate's vertical displacement, which is that of all
nodes on the plate; the last equation is that the plate carries the given force.

Each iteration is a damped trial: it is accepted, or asks for a new tangent, or leaps past a kink of
the contact, or is an error. PETSc's SNES counts iterations to lag its Jacobian, and its line search
looks at the residual's norm: in that way the scenes of `cases/` took 1.5 to 4 times the tangents.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.direct_solver import factorise, solve
from iceslide_fem.rubber.contact import Traction, contact_forces, contact_state, contact_tangent
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody

MAX_ITERATIONS = 60
# So many iterations with a kept tangent are worth it: a new one costs as much as five in a slice,
# fifteen in a block.
PATIENCE = 12
# Of a new tangent's change; a kept one is taken whole or not at all.
DAMPINGS = tuple(0.5**n for n in range(8))
# Where no damping shortens the next change, a point of the contact touches down or lifts off on
# the way; a full step leads past it (watchdog). So many in one solve.
LEAPS = 4

# Tangential traction on the rubber of the contact pressure (f, q) and displacement (f, q, d-1).
TractionLaw = Callable[[Array, Array], Traction]


class Solution(NamedTuple):
    """Newton iterations and tangents that one equilibrium took, and the residual left (N)."""

    iterations: int
    tangents: int
    residual: float


class Trial(NamedTuple):
    """Where a damped change leads: whether it is accepted, the residual's norm (N) there, the next
    change by the same tangent and its length over this one's; `finite` is the first damping that
    turned no element inside out, if any.

    Accepted is what makes the next change shorter (the natural monotonicity test of P. Deuflhard,
    Newton Methods for Nonlinear Problems, Springer 2004, ch. 3), or what reaches the tolerance.
    """

    accepted: bool
    damping: float
    size: float
    contraction: float
    following: Array
    finite: float | None


class Equilibrium:
    """Solves for the displacements of `rubber` and the plate.

    force (N; N/m in a slice; half of it in a half model) and the traction law are given per
    solve; the factorised tangent is kept from one solve to the next.
    """

    def __init__(
        self,
        rubber: HyperelasticBody,
        surface: ContactSurface,
        penalty: float,
        prefix: str = "rubber_",
        patience: int = PATIENCE,
    ) -> None:
        """`penalty` in Pa/m; `prefix` selects PETSc options of the linear solver.

        A tangent is kept if `patience` iterations like the last one would reach the tolerance; 0 is
        full Newton.
        """
        self.rubber, self.surface, self.penalty = rubber, surface, penalty
        self._matrix = rubber.create_matrix()
        self._residual, self._newton = rubber.create_vector(), rubber.create_vector()
        self._plate_column, self._plate_row = rubber.create_vector(), rubber.create_vector()
        self._border = rubber.create_vector()
        self._plate_stiffness = 0.0
        self._patience = patience
        self._has_tangent = False
        dim = rubber.mesh.geometry.dim
        index_map = rubber.space.dofmap.index_map
        n_owned = index_map.size_local
        owned = rubber.plate[rubber.plate < n_owned]
        self._plate_z = owned * dim + dim - 1
        symmetry = rubber.symmetry[rubber.symmetry < n_owned] * dim + 1
        plate = (owned[:, None] * dim + np.arange(dim)).ravel()
        self._fixed = np.unique(np.concatenate([plate, symmetry])).astype(np.int32)
        self._first = index_map.local_range[0] * dim
        self._lift = rubber.create_vector()
        self._lift.array[self._plate_z] = 1.0
        self._ksp = self._solver(prefix)

    def _solver(self, prefix: str) -> PETSc.KSP:
        ksp = PETSc.KSP().create(self.rubber.mesh.comm)
        ksp.setType("preonly")
        ksp.setOptionsPrefix(prefix)
        ksp.setOperators(self._matrix)
        factorise(ksp, self.rubber.mesh.geometry.dim)
        ksp.setFromOptions()
        return ksp

    def solve(self, force: float, law: TractionLaw, tolerance: float) -> Solution:
        """Find equilibrium from the present displacements; plate force `force`, downwards.

        `tolerance` (N) is the norm of the residual to reach, or what rounding leaves of it. Raises
        NotConverged, with the displacements at the last iterate: the caller restores what it had.
        """
        values = self.rubber.u.x.array
        tolerance = max(tolerance, self.rubber.force_rounding())
        tangents = leaps = 0
        size = smallest = self._imbalance(force, law)
        change = self._kept_direction()
        for iteration in range(MAX_ITERATIONS):
            if size <= tolerance:
                return Solution(iteration, tangents, size)
            smallest = min(size, smallest)
            fresh = change is None
            if change is None:
                change, tangents = self._new_direction(law, size), tangents + 1
            start = values.copy()
            trial = self._trial(force, law, tolerance, change, DAMPINGS if fresh else DAMPINGS[:1])
            if trial.accepted:
                size = trial.size
                soon = size * trial.contraction**self._patience <= tolerance
                self._has_tangent = soon and trial.damping == 1.0
                change = trial.following if self._has_tangent else None
                continue
            if not fresh:  # a kept tangent: the one that belongs here is another
                values[:] = start
            elif leaps < LEAPS and trial.finite is not None:
                values[:] = start + trial.finite * change
                leaps += 1
            else:
                raise NotConverged(_stuck(smallest, force))
            size, change = self._imbalance(force, law), None
        raise NotConverged(_stuck(smallest, force))

    def _trial(
        self,
        force: float,
        law: TractionLaw,
        tolerance: float,
        change: Array,
        dampings: tuple[float, ...],
    ) -> Trial:
        """Go along `change` by the first of `dampings` that is accepted, or the last of them."""
        values, length = self.rubber.u.x.array, self._length(change)
        start, finite = values.copy(), None
        for damping in dampings:
            values[:] = start + damping * change
            size = self._imbalance(force, law)
            if finite is None and np.isfinite(size):
                finite = damping
            following = self._direction()
            contraction = self._length(following) / length if length > 0.0 else np.inf
            accepted = size <= tolerance or contraction <= 1.0 - 0.25 * damping  # not if NaN
            if accepted:
                break
        return Trial(accepted, damping, size, contraction, following, finite)

    def _kept_direction(self) -> Array | None:
        """Newton's change by the tangent of an earlier solve, if it is there and gives one."""
        change = self._direction() if self._has_tangent else None
        return change if change is not None and self._is_finite(change) else None

    def _new_direction(self, law: TractionLaw, size: float) -> Array:
        """Newton's change by the tangent at the present displacements, with a residual `size`."""
        if not np.isfinite(size):
            raise NotConverged("elements of the rubber are inverted")
        self._linearise(law)
        change = self._direction()
        if not self._is_finite(change):
            raise NotConverged("the tangent is singular")
        return change

    def forget(self) -> None:
        """Drop the kept tangent (after the displacements were restored from far away)."""
        self._has_tangent = False

    def plate_displacement(self) -> float:
        """Downward displacement of the plate, m. Collective."""
        own = self.rubber.u.x.array[self._plate_z]
        down = float(-own[0]) if own.size else -np.inf
        return float(self.rubber.mesh.comm.allreduce(down, op=MPI.MAX))

    def _traction(self, law: TractionLaw) -> Traction:
        u = self.rubber.displacements
        pressure = contact_state(self.surface, u, self.penalty).pressure
        return law(pressure, self.surface.displacements(u)[..., :-1])

    def _imbalance(self, force: float, law: TractionLaw) -> float:
        """Norm of internal minus external forces (N); leaves the residual and the plate's."""
        u, residual = self.rubber.displacements, self._residual
        self.rubber.internal_forces(residual)
        forces = contact_forces(self.surface, u, self.penalty, self._traction(law))
        with residual.localForm() as local:
            self.surface.scatter(-forces, local.array.reshape(u.shape))
        compat.sum_ghosts(residual)
        self._plate_imbalance = residual.dot(self._lift) + force
        residual.array[self._fixed] = 0.0
        return float(np.hypot(residual.norm(), self._plate_imbalance))

    def _linearise(self, law: TractionLaw) -> None:
        """Assemble and factorise the tangent at the present displacements."""
        u, matrix, dim = self.rubber.displacements, self._matrix, self.rubber.mesh.geometry.dim
        self.rubber.tangent(matrix)
        blocks = contact_tangent(self.surface, u, self.penalty, self._traction(law))
        rows = self.surface.dofs[:, :, None] * dim + np.arange(dim, dtype=np.int32)
        for row, block in zip(rows, blocks, strict=True):
            values = -block.reshape(row.size, row.size)
            matrix.setValuesLocal(row.ravel(), row.ravel(), values, PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
        matrix.mult(self._lift, self._plate_column)
        matrix.multTranspose(self._lift, self._plate_row)
        self._plate_stiffness = self._plate_column.dot(self._lift)
        for vector in (self._plate_column, self._plate_row):
            vector.array[self._fixed] = 0.0
        matrix.zeroRowsColumns(self._fixed + self._first, diag=1.0)
        self._ksp.setOperators(matrix)
        self._solve_linear(self._plate_column, self._border)
        self._has_tangent = True

    def _solve_linear(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve with the kept factors. Raises NotConverged where PETSc's solver fails."""
        if not solve(self._ksp, right, solution):
            self._has_tangent = False
            reason = self._ksp.getConvergedReason()
            raise NotConverged(f"the linear solver fails (PETSc's reason {reason})")

    def _direction(self) -> Array:
        """Newton's change of the bordered system from the kept factors, by block elimination."""
        self._solve_linear(self._residual, self._newton)
        schur = self._plate_stiffness - self._plate_row.dot(self._border)
        if schur == 0.0:
            self._has_tangent = False
            raise NotConverged("the plate meets no resistance")
        lift = -(self._plate_imbalance - self._plate_row.dot(self._newton)) / schur
        self._newton.scale(-1.0)
        self._newton.axpy(-lift, self._border)
        self._newton.axpy(lift, self._lift)
        compat.update_ghosts(self._newton)
        with self._newton.localForm() as local:
            return np.array(local.array)

    def _is_finite(self, change: Array) -> bool:
        return 0.0 < self._length(change) < np.inf

    def _length(self, change: Array) -> float:
        own = change[: self._newton.getLocalSize()]
        return float(np.sqrt(self.rubber.mesh.comm.allreduce(float(own @ own), op=MPI.SUM)))


def _stuck(residual: float, force: float) -> str:
    """Why there is no equilibrium, from the smallest residual (N) on the way to `force` (N)."""
    if not residual < force:
        return "elements of the rubber turn inside out on the way to it"
    return f"Newton's method leaves {residual / force:.1g} of the load unbalanced"
