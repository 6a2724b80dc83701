"""Newton changes of rubber and plate: factors of an earlier tangent, with the present contact.

A tangent costs as much as some forty solves with its factors. Between iterations the rubber's
stiffness hardly changes, but the contact does: points touch down and lift off, and the slope of
shear with slip depends on the step. The contact part is exact in every change (`responses`).
Symmetric factors take half of the time and memory. They contain the rubber and the symmetric
contact stiffness; the coupling of friction to pressure is in the changes only.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.sparse import csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.direct_solver import (
    factorise,
    solve,
    solve_many,
    takes_blocks,
    takes_many,
    takes_symmetric,
)
from iceslide_fem.mechanics.contact_nodes import RESULTANT, ContactNodes
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mechanics.responses import Responses
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged


def rigid_modes(rubber: HyperelasticBody) -> PETSc.NullSpace:
    """The orthonormal rigid motions of `rubber`: three in a slice, six in a block. Collective."""
    dim, comm = rubber.mesh.geometry.dim, rubber.mesh.comm
    n_owned = rubber.space.dofmap.index_map.size_local
    x = rubber.space.tabulate_dof_coordinates()[:n_owned, :dim]
    motions = [np.eye(dim)[axis] * np.ones_like(x) for axis in range(dim)]
    for one, other in itertools.combinations(range(dim), 2):
        turning = np.zeros_like(x)
        turning[:, one], turning[:, other] = -x[:, other], x[:, one]
        motions.append(turning)
    modes: list[PETSc.Vec] = []
    for motion in motions:
        mode = rubber.create_vector()
        mode.array[:] = motion.ravel()
        for before in modes:
            mode.axpy(-mode.dot(before), before)
        mode.normalize()
        modes.append(mode)
    return PETSc.NullSpace().create(vectors=modes, comm=comm)


# Relative residual of the contact part in a change. A smaller one does not help Newton's method,
# because the rubber's part of the tangent is an old one.
FORCING = 0.03
# The same with factors of the present iterate, which may be symmetric.
FRESH = 1e-3
# Cost of assembly and factorisation, and of a new preconditioner, in solves.
FACTORS, PRECONDITIONER = 40.0, 1.0
DIRECT = ("lu", "cholesky", "redundant", "python")


class Tangent:
    """The tangent of `rubber` on its contact `surface`, bordered by the plate's displacement.

    This is the common downward displacement of all nodes on the plate; its equation prescribes the
    plate's force. Changes contain all dofs of this rank, ghosts included.
    """

    def __init__(self, rubber: HyperelasticBody, surface: ContactSurface, prefix: str) -> None:
        """`prefix` selects PETSc options of the linear solver."""
        self._rubber, self._surface, self._comm = rubber, surface, rubber.mesh.comm
        self._dim = rubber.mesh.geometry.dim
        self._matrix = rubber.create_matrix()
        vectors = (rubber.create_vector() for _ in range(6))
        self._column, self._row, self._border, self.load_vector, self._answer, self._lift = vectors
        self._stiffness = 0.0  # of the plate's equation
        index_map = rubber.space.dofmap.index_map
        n_owned = index_map.size_local
        owned = rubber.plate[rubber.plate < n_owned]
        self.plate_z = owned * self._dim + self._dim - 1
        symmetry = rubber.symmetry[rubber.symmetry < n_owned] * self._dim + 1
        plate = (owned[:, None] * self._dim + np.arange(self._dim)).ravel()
        self._fixed = np.unique(np.concatenate([plate, symmetry])).astype(np.int32)
        self._first = index_map.local_range[0] * self._dim
        self._lift.array[self.plate_z] = 1.0
        self._factored: Array = np.zeros(0)  # the contact's part of the factors
        self._factored_walls = rubber.wall_stiffness()
        self._differs = self._held = False
        self._forcing = FORCING
        self.nodes = ContactNodes(
            surface, rubber.self_contact, self.load_vector, self._fixed, self.plate_z
        )
        self.ksp = PETSc.KSP().create(self._comm)
        self.ksp.setType("preonly")
        self.ksp.setOptionsPrefix(prefix)
        self.ksp.setOperators(self._matrix)
        factorise(self.ksp, self._dim)
        compat.take_options(self.ksp)
        if takes_blocks(self.ksp):
            self.ksp.reset()  # its setup is for a matrix without blocks
            self._matrix = rubber.create_matrix("baij")
            self.ksp.setOperators(self._matrix)
        self._symmetric = takes_symmetric(self.ksp)
        direct = self.ksp.getPC().getType() in DIRECT
        if not direct:
            self._matrix.setNearNullSpace(rigid_modes(rubber))
        cost = FACTORS if direct else PRECONDITIONER
        self._responses = Responses(self.nodes, cost, takes_many(self.ksp))

    def imbalance(self, residual: PETSc.Vec) -> float:
        """Remove the plate's reaction from the `residual`; returns its vertical resultant (N).
        Collective.

        In 3-D the reaction of the symmetry plane is also removed.
        """
        plate = residual.dot(self._lift)
        residual.array[self._fixed] = 0.0
        return float(plate)

    def size(self, residual: PETSc.Vec, plate: float | None) -> float:
        """Norm of the imbalance, N: nodal forces, their resultant, and the plate's force.
        Collective.

        Without the resultant the norm would miss a uniform change of friction at many nodes. The
        block would then follow in one late step.
        """
        forces = residual.array.reshape(-1, self._dim)
        # ten times faster than a sum over short rows
        resultant = RESULTANT * (np.ones(len(forces)) @ forces)
        self._comm.Allreduce(MPI.IN_PLACE, resultant, op=MPI.SUM)
        return math.hypot(residual.norm(), plate or 0.0, *resultant)

    def factorise(self, contact: Array) -> None:
        """Assemble and factorise at the present displacements.

        `contact`: derivatives (f, a, d, a, d) of the forces on the contact's f whole facets.
        Raises NotConverged where the linear solver fails.
        """
        matrix, dim, dofs = self._matrix, self._dim, self._surface.dofs[self._surface.firsts]
        walls = self._rubber.wall_stiffness()
        self._factored, self._factored_walls, self._differs = contact, walls, False
        if self._symmetric:
            self._factored = _symmetric(contact)
            self._factored_walls = None if walls is None else (0.5 * (walls + walls.T)).tocsr()
        self._rubber.tangent(matrix, self._factored_walls)
        self._responses.clear()
        rows = dofs[:, :, None] * dim + np.arange(dim, dtype=np.int32)
        for row, block in zip(rows, self._factored, strict=True):
            values = -block.reshape(row.size, row.size)
            matrix.setValuesLocal(row.ravel(), row.ravel(), values, PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
        matrix.mult(self._lift, self._column)
        matrix.multTranspose(self._lift, self._row)
        self._stiffness = self._column.dot(self._lift) + self._rubber.lift_slope(self.load_vector)
        self._stiffness += 2.0 * self.load_vector.dot(self._lift)
        for vector in (self._column, self._row):
            vector.axpy(1.0, self.load_vector)
        for vector in (self._column, self._row):
            vector.array[self._fixed] = 0.0
        matrix.zeroRowsColumns(self._fixed + self._first, diag=1.0)
        self.ksp.setOperators(matrix)
        self._solve(self._column, self._border)
        self._forcing = FRESH
        if self._symmetric:
            self._differ(contact, walls)

    def update_contact(self, contact: Array) -> None:
        """Set the present `contact` (as in `factorise`), and keep the factors."""
        self._forcing = FORCING
        self._differ(contact, self._rubber.wall_stiffness())

    def change(self, residual: PETSc.Vec, plate: float | None, enough: float = 0.0) -> Array:
        """Newton change for a `residual` (N) and the plate's imbalance (N). Collective.

        plate: None for a held plate; enough: residual of the contact part, N. Raises NotConverged
        if the linear solver fails or the plate meets no resistance.
        """
        if self._held != (plate is None):
            self._responses.clear()
        self._held, imbalance = plate is None, plate or 0.0
        self.load_vector.array[:] = -residual.array
        answer, size = self.solved(-imbalance), self.size(residual, plate)
        if self._differs and 0.0 < size < np.inf:
            limit = max(self._forcing * size, enough)
            answer -= self._responses.correction(answer, limit, self.response)
        return answer

    def _differ(self, contact: Array, walls: csr_matrix | None) -> None:
        """Set present contact and wall stiffness, different from those in the factors."""
        nodes = contact.shape[1] * contact.shape[2]
        if walls is not None:
            walls = walls - self._factored_walls
        difference = (self._factored - contact).reshape(len(contact), nodes, nodes)
        self._responses.differ(difference, walls)
        self._differs = True

    @property
    def stale(self) -> bool:
        """Whether a new factorisation would reduce the cost."""
        return self._responses.stale

    def length(self, change: Array) -> float:
        """Norm of a change over all ranks' dofs, m. Collective."""
        own = change[: self._answer.getLocalSize()]
        return float(np.sqrt(self._comm.allreduce(float(own @ own), op=MPI.SUM)))

    def response(self, loads: Array) -> Array:
        """Changes (k, dofs) by the factors for loads (k, n) on the contact nodes."""
        if takes_many(self.ksp):
            return self._responses_at_once(loads)
        with self.load_vector.localForm() as local:
            local.set(0.0)
        self.load_vector.array[self.nodes.own] = self.nodes.on_own(loads[0])
        return self.solved(loads[0, -1])[None]

    def _responses_at_once(self, loads: Array) -> Array:
        changes = []
        for load, answer in zip(
            loads, solve_many(self.ksp, self.nodes.entries(loads)), strict=True
        ):
            self._answer.array[:] = answer
            changes.append(self._lifted(load[-1]))
        return np.array(changes)

    def solved(self, plate: float) -> Array:
        """The change by the factors for nodal and plate loads, by block elimination."""
        self._solve(self.load_vector, self._answer)
        return self._lifted(plate)

    def _lifted(self, plate: float) -> Array:
        """The solution under a held plate plus the part of the plate's load, all local dofs."""
        if not self._held:
            schur = self._stiffness - self._row.dot(self._border)
            if schur == 0.0:
                raise NotConverged("the plate meets no resistance")
            lift = (plate - self._row.dot(self._answer)) / schur
            self._answer.axpy(-lift, self._border)
            self._answer.axpy(lift, self._lift)
        compat.update_ghosts(self._answer)
        with self._answer.localForm() as local:
            return np.array(local.array)

    def _solve(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve with the kept factors. Raises NotConverged where PETSc's solver fails."""
        if not solve(self.ksp, right, solution):
            reason = self.ksp.getConvergedReason()
            raise NotConverged(f"the linear solver fails (PETSc's reason {reason})")


def _symmetric(contact: Array) -> Array:
    """Symmetric part of a contact tangent (f, a, d, a, d), N/m.

    It has the stiffness of pressure and of slip, without the coupling of friction to pressure.
    """
    apart = contact.copy()
    apart[:, :, -1, :, :-1] = 0.0
    apart[:, :, :-1, :, -1] = 0.0
    return np.asarray(0.5 * (apart + apart.transpose(0, 3, 4, 1, 2)))
