"""Hyperelastic rubber: internal forces and tangent of its energy (`element`) on a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.mechanics.element import DEGREE, Energy, kinds_of_cells, stored_energy
from iceslide_fem.mechanics.materials import Material, Materials
from iceslide_fem.mechanics.plate_contact import PlateContact
from iceslide_fem.mechanics.self_contact import SelfContact
from iceslide_fem.mechanics.viscoelasticity import Relaxed, Viscoelasticity, relaxing_energy
from iceslide_fem.mesh.gmsh_model import DistributedMesh
from iceslide_fem.runtime.arrays import Array

NEAR_PLATE = 0.25  # of the height: rubber farther below the plate does not touch it


class HyperelasticBody:
    """Forms of the rubber block and its displacement Function `u`.

    plate: blocked dofs on the rigid plate (this rank's, with ghosts); symmetry: blocked dofs fixed
    in y; kinds: of this rank's cells (`kinds_of_cells`); dx: measure with these subdomains;
    materials: of the cells.
    """

    def __init__(
        self,
        block: DistributedMesh,
        materials: Mapping[str, Material],
        degree: int = DEGREE,
        energy: Energy = stored_energy,
    ) -> None:
        """Compile the forms on the mesh of `block`.

        materials: of its regions; a density adds inertia forces; degree (1 or 2), energy: another
        element than the default.
        """
        self.mesh, self.materials = block.mesh, Materials(block, materials)
        self.space = compat.vector_space(self.mesh, degree)
        self.u = fem.Function(self.space, name="displacement")
        self._moved = np.asarray(self.u.x.array).reshape(-1, self.mesh.geometry.dim)
        self.block = block
        constants = self.materials.constants
        self.kinds = kinds_of_cells(block)
        self.dx = dx = compat.cell_measure(self.mesh, self.kinds)
        self.viscoelasticity: Viscoelasticity | None = None
        functional = potential = energy(self.u, constants, dx)
        if self.materials.relaxing:
            self.viscoelasticity = Viscoelasticity(self.u, self.materials)
            potential = relaxing_energy(self.viscoelasticity.history)(self.u, constants, dx)
        test, trial = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        residual = ufl.derivative(potential, self.u, test)
        if self.materials.have_mass:
            self._reference, self._velocity = fem.Function(self.space), fem.Function(self.space)
            self._weight = fem.Constant(self.mesh, PETSc.ScalarType(0.0))
            mass = self.materials.density
            change = self._weight * (self.u - self._reference)
            residual += mass * ufl.inner(change, test) * dx
            square = ufl.inner(self._velocity, self._velocity)
            self._kinetic = compat.form(0.5 * mass * square * dx)
            self._momentum = compat.form(mass * self._velocity[0] * dx)
            masses = compat.create_vector(self.space)
            compat.assemble_vector(masses, compat.form(mass * sum(test) * dx))
            self._mass = masses.norm()
        self._energy = compat.form(functional)
        self._residual = compat.form(residual)
        self._tangent = compat.form(ufl.derivative(residual, self.u, trial))
        self.self_contact: SelfContact | None = None
        self.beside: PlateContact | None = None
        self.plate_reaction = 0.0  # N, of sides on the plate, at the last forces
        self.plate = self._dofs("plate")
        self.symmetry = self._dofs("symmetry") if "symmetry" in block.tags else self.plate[:0]

    @property
    def displacements(self) -> Array:
        """Nodal displacements of this rank, ghosts included (blocked dofs, d): a view, m."""
        return self._moved

    @property
    def n_dofs(self) -> int:
        """Displacement unknowns on all ranks."""
        return int(self.space.dofmap.index_map.size_global * self.mesh.geometry.dim)

    def facets(self, name: str) -> Any:
        """Local numbers of facets with the tag `name`; empty without this tag."""
        tags = self.block.facet_tags
        if name not in self.block.tags:
            return tags.indices[:0]
        return tags.indices[tags.values == self.block.tags[name]]

    def enable_self_contact(self, penalty: float, friction: float = 0.0) -> None:
        """Enable self-contact of facets tagged `walls`: penalty, Pa/m; friction coefficient.

        It adds to the internal forces, the tangent and the elastic energy. Collective.
        """
        if "walls" in self.block.tags:
            self.self_contact = SelfContact(self.space, self.facets("walls"), penalty, friction)

    def enable_plate_contact(self, height: float, penalty: float) -> None:
        """Enable contact of sides with the plate's plane: penalty, Pa/m; height of the block, m.

        It adds to the internal forces, the tangent and the elastic energy. `plate_reaction` is its
        force on the plate.
        """
        facets = np.concatenate([self.facets("sides"), self.facets("contact")])
        middles = compat.midpoints(self.mesh, facets)[:, self.mesh.geometry.dim - 1]
        facets = np.sort(facets[middles > NEAR_PLATE * height])
        self.beside = PlateContact(self.space, facets, self.plate, height, penalty)

    def create_vector(self) -> PETSc.Vec:
        """Vector of nodal forces, with ghosts."""
        return compat.create_vector(self.space)

    def create_matrix(self, kind: str | None = None) -> PETSc.Mat:
        """Matrix with the tangent's sparsity, of PETSc's default `kind` or another.

        Self-contact may add entries later.
        """
        matrix = compat.create_matrix(self._tangent, kind)
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, self.self_contact is None)
        return matrix

    def internal_forces(self, vector: PETSc.Vec) -> None:
        """Overwrite `vector` with this rank's part of the internal forces (ghosts not summed)."""
        compat.assemble_shares(vector, self._residual)
        with vector.localForm() as local:
            forces = local.array.reshape(-1, self.mesh.geometry.dim)
            if self.self_contact is not None:
                self.self_contact.add_forces(self.displacements, forces)
            if self.beside is not None:
                self.plate_reaction = self.beside.add_forces(self.displacements, forces)

    def tangent(self, matrix: PETSc.Mat, walls: csr_matrix | None = None) -> None:
        """Overwrite `matrix` with the derivative of the internal forces at `u`.

        walls: stiffness of self-contact, N/m; by default `wall_stiffness`.
        """
        compat.assemble_matrix(matrix, self._tangent)
        stiffness = self.wall_stiffness() if walls is None else walls
        if self.self_contact is not None and stiffness is not None:
            self.self_contact.add_tangent(stiffness, matrix)
        if self.beside is not None:
            self.beside.add_tangent(self.displacements, matrix)

    def wall_stiffness(self) -> csr_matrix | None:
        """Part of self-contact in the tangent at `u` (`SelfContact.stiffness`). Collective."""
        return (
            None if self.self_contact is None else self.self_contact.stiffness(self.displacements)
        )

    def lift_slope(self, vector: PETSc.Vec) -> float:
        """Derivative of the internal forces with a lift of the plate's plane at fixed nodes.

        Overwrites `vector` with it (ghosts summed). Returns the derivative of the plate's force,
        N/m.
        """
        own = 0.0
        with vector.localForm() as local:
            local.set(0.0)
            if self.beside is not None:
                forces = local.array.reshape(-1, self.mesh.geometry.dim)
                own = self.beside.add_lift(self.displacements, forces)
        compat.sum_ghosts(vector)
        return own

    def set_inertia(self, weight: float, reference: Array) -> None:
        """Inertia forces density * weight * (u - reference); weight in 1/s2, reference in m.

        Only with a density; zero until this is called.
        """
        self._weight.value = weight
        self._reference.x.array[:] = reference

    def force_rounding(self) -> float:
        """Norm (N) of the rounding error of the inertia forces. Collective.

        These are weight * mass * (u - reference) with a weight of 1 / dt^2. At steps of picoseconds
        the rounding of u exceeds the elastic forces.
        """
        if not self.materials.have_mass:
            return 0.0
        own = float(np.abs(self.u.x.array).max(initial=0.0))
        largest = self.mesh.comm.allreduce(own, op=MPI.MAX)
        return float(np.finfo(float).eps * abs(self._weight.value) * self._mass * largest)

    def kinetic_energy(self, velocity: Array) -> float:
        """Kinetic energy, J (J/m in a slice), of nodal velocities, m/s; only with a density.

        Collective.
        """
        self._velocity.x.array[:] = velocity
        return compat.assemble_scalar(self._kinetic, self.mesh.comm)

    def momentum(self, velocity: Array) -> float:
        """Momentum along x, N s (N s/m in a slice), of nodal velocities; only with a density.

        For displacements it is the mass times the displacement of its centre. Collective.
        """
        self._velocity.x.array[:] = velocity
        return compat.assemble_scalar(self._momentum, self.mesh.comm)

    def elastic_energy(self, relaxed: Relaxed | None = None) -> float:
        """Stored energy, J (J/m in a slice); relaxed: internal variables, if any. Collective."""
        pressing = (self.self_contact, self.beside)
        pressed = sum(one.energy(self.displacements) for one in pressing if one is not None)
        if relaxed is not None and self.viscoelasticity is not None:
            pressed += self.viscoelasticity.total(relaxed.stored)
        return compat.assemble_scalar(self._energy, self.mesh.comm) + pressed

    def _dofs(self, name: str) -> Any:
        dim = self.mesh.topology.dim
        return fem.locate_dofs_topological(self.space, dim - 1, self.facets(name))
