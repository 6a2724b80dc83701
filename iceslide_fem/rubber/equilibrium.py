"""Quasi-static equilibrium of the block under its plate: globalised Newton, bordered by the plate.

Unknowns are the nodal displacements and the plate's vertical displacement, which is that of all
nodes on the plate; the last equation is that the plate carries the given force.
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
SMALLEST_DAMPING = 1.0 / 64.0
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
        size = self._imbalance(force, law)
        change = self._direction() if self._has_tangent else None
        for iteration in range(MAX_ITERATIONS):
            if size <= tolerance:
                return Solution(iteration, tangents, size)
            fresh = change is None
            if change is None:
                if not np.isfinite(size):
                    raise NotConverged("elements of the rubber are inverted")
                self._linearise(law)
                tangents += 1
                change = self._direction()
            start, length = values.copy(), self._length(change)
            if not 0.0 < length < np.inf:
                if fresh:
                    raise NotConverged("the tangent is singular")
                change = None
                continue
            damping, leap = 1.0, np.nan
            while True:
                values[:] = start + damping * change
                size = self._imbalance(force, law)
                if np.isfinite(size) and np.isnan(leap):
                    leap = damping
                following = self._direction()
                contraction = self._length(following) / length
                if contraction <= 1.0 - 0.25 * damping:
                    break
                if size <= tolerance or damping < SMALLEST_DAMPING or not fresh:
                    break
                damping *= 0.5
            if not (size <= tolerance or contraction <= 1.0 - 0.25 * damping):  # NaN, too
                if fresh and (leaps == LEAPS or np.isnan(leap)):
                    raise NotConverged(f"no descent, residual {size:.3g} N")
                # A kept tangent points the wrong way from here: take the one that belongs here.
                values[:] = start + (leap * change if fresh else 0.0)
                leaps += fresh
                size = self._imbalance(force, law)
                change = None
                continue
            keep = damping == 1.0 and size * contraction**self._patience <= tolerance
            change = following if keep else None
            self._has_tangent = keep
        raise NotConverged(f"residual of {size:.3g} N after {MAX_ITERATIONS} iterations")

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

    def _length(self, change: Array) -> float:
        own = change[: self._newton.getLocalSize()]
        return float(np.sqrt(self.rubber.mesh.comm.allreduce(float(own @ own), op=MPI.SUM)))
