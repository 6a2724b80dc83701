"""Heat conduction in the meshed ice below the contact: the `continuum` model.

The contact points lie anywhere on the ice's surface. Every rank knows the surface's grid: points
read their temperature from it by (bi)linear interpolation and give their heat to the same nodes
with the same weights, so that the heat that leaves the interface is the heat that enters the ice.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.fenics.direct_solver import factorise, solve
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, SurfaceGrid
from iceslide_fem.materials import (
    ICE_CONDUCTIVITY,
    ICE_DENSITY,
    ICE_HEAT_CAPACITY,
)
from iceslide_fem.mesh.ice import IceMesh

# Where it melts, the surface is held at T_m through a resistance of this share of the first
# layer's: the flux is then a function of the point's temperature, and unique.
RESISTANCE_SHARE = 1e-3
MAX_ITERATIONS = 25
RELATIVE_RESIDUAL = 1e-8
# The factors of an older matrix precondition as long as they need no more iterations than this.
PATIENCE = 10


class Continuum:
    """Heat equation on the ice mesh, linear elements; content: T - T_0 at this rank's nodes.

    nodes: this rank's on the ice's whole grid; grid: that of its surface. T_0 in K.
    """

    def __init__(self, mesh: IceMesh, temperature: float) -> None:
        """Ice at `temperature` (K), without points yet."""
        self._initial = temperature
        self.space = compat.scalar_space(mesh.mesh, 1)
        self.function = fem.Function(self.space, name="temperature")
        T, test = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        capacity = compat.form(ICE_DENSITY * ICE_HEAT_CAPACITY * T * test * ufl.dx)
        flux = ICE_CONDUCTIVITY * ufl.inner(ufl.grad(T), ufl.grad(test))
        conduction = compat.form(flux * ufl.dx)
        self._capacity = compat.assemble_matrix(compat.create_matrix(capacity), capacity)
        self._conduction = compat.assemble_matrix(compat.create_matrix(conduction), conduction)
        self._x, self._b = self._conduction.createVecs()
        self._comm = mesh.mesh.comm
        self.resistance = RESISTANCE_SHARE * float(mesh.z[-1] - mesh.z[-2]) / ICE_CONDUCTIVITY
        self._number_nodes(mesh)
        self._lump_across()
        self._contacts = Contacts(self.grid.own_nodes(), np.zeros(self.grid.own.size))
        self._solver = LaggedSolver(self._conduction, len(self._shape))

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns on all ranks."""
        return int(self.space.dofmap.index_map.size_global)

    def initial(self, n_points: int) -> Array:
        """Content of ice at its initial temperature (whatever the number of points)."""
        return np.zeros(self._x.getLocalSize())

    def under(self, contacts: Contacts) -> Continuum:
        """The same ice as it answers below `contacts`."""
        below = copy(self)
        below._contacts = contacts
        return below

    def surface_temperature(self, content: Array) -> Array:
        """Temperature at the points (K), shape (n,). Collective."""
        grid = self.grid.allgather(content[self._own_dof])
        return self._initial + self.grid.interpolate(grid, self._contacts.at)

    def shifted(self, content: Array, cells: int) -> Array:
        """Content after the window has moved `cells` cells in +x: fresh ice enters. Collective."""
        nodes = np.zeros(self._shape)
        nodes.flat[self.nodes.numbers] = content
        self._comm.Allreduce(MPI.IN_PLACE, nodes, op=MPI.SUM)
        moved = np.zeros_like(nodes)
        moved[: nodes.shape[0] - cells] = nodes[cells:]
        return np.array(moved.flat[self.nodes.numbers])

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """Solve C (x - start) / dt + K x = heat from the film, with the film law. Collective.

        Newton's method: where a point melts (or the rubber takes heat, too), its flux depends on
        the temperature through `resistance`. Raises NotConverged if the set of melting points does
        not settle.
        """
        content = start.copy()
        resistance = np.full(self._contacts.area.shape, self.resistance)
        scale, near = 0.0, None
        for _ in range(MAX_ITERATIONS):
            result = film.solve(Surface.of(self.surface_temperature(content), resistance), near)
            near = result.log_height
            heat = self._load(result.ice_flux)
            self._x.array[:] = (content - start) / float(dt)
            self._capacity.mult(self._x, self._b)
            self._x.array[:] = content
            self._conduction.multAdd(self._x, self._b, self._b)
            self._b.array[self._own_dof] -= heat
            residual = self._b.norm()
            scale = max(scale, residual)
            if residual <= RELATIVE_RESIDUAL * scale:
                return content, result
            self._correct(float(dt), self._contacts.area * result.ice_slope / resistance)
            content = content - self._x.array
        raise NotConverged("the melting part of the ice's surface does not settle")

    def heat(self, content: Array) -> float:
        """Heat above the initial temperature, J (J/m in a slice). Collective."""
        self._x.array[:] = content
        self._capacity.mult(self._x, self._b)
        return float(self._b.sum())

    def show(self, content: Array) -> Any:
        """The temperature (K) as a Function, for output. Collective."""
        self.function.x.array[: content.size] = self._initial + content
        self.function.x.scatter_forward()
        return self.function

    def _number_nodes(self, mesh: IceMesh) -> None:
        """Place of every node of this rank on the mesh's grid; the surface's nodes and dofs."""
        lines = [line for line in (mesh.x, mesh.y, mesh.z) if line.size]
        index_map = self.space.dofmap.index_map
        positions = self.space.tabulate_dof_coordinates()[: index_map.size_local]
        places = [
            np.searchsorted(0.5 * (line[1:] + line[:-1]), positions[:, axis])
            for axis, line in enumerate(lines)
        ]
        self._shape = tuple(line.size for line in lines)
        numbers = np.ravel_multi_index(places, self._shape)
        self.nodes = OwnNodes(numbers, int(np.prod(self._shape)))
        self._own_dof = np.flatnonzero(places[-1] == lines[-1].size - 1)
        own = numbers[self._own_dof] // lines[-1].size
        self.grid = SurfaceGrid(lines[:-1], own, self._comm)
        dofs = (self._own_dof + index_map.local_range[0]).astype(float)
        self._global_dof = self.grid.allgather(dofs).astype(PETSc.IntType)

    def _lump_across(self) -> None:
        """Lump the capacity matrix in x and y, and leave it as it is in z.

        Lines of nodes below each other keep the accuracy of the consistent matrix, while nodes
        beside a sudden flux, as ahead of a leading edge, are not cooled by it.
        """
        first, last = self._capacity.getOwnershipRange()
        levels = self._shape[-1]
        dof_of_node = np.zeros(self.nodes.total, dtype=np.int64)
        dof_of_node[self.nodes.numbers] = np.arange(first, last)
        self._comm.Allreduce(MPI.IN_PLACE, dof_of_node, op=MPI.SUM)
        node_of_dof = np.argsort(dof_of_node)
        rows = [self._capacity.getRow(row) for row in range(first, last)]
        self._capacity.zeroEntries()
        for row, (columns, values) in enumerate(rows, start=first):
            above = node_of_dof[row] // levels * levels
            below = dof_of_node[above + node_of_dof[columns] % levels].astype(PETSc.IntType)
            self._capacity.setValues([row], below, values, addv=PETSc.InsertMode.ADD_VALUES)
        self._capacity.assemble()

    def _load(self, flux: Array) -> Array:
        """Heat (W) that the points give to this rank's surface nodes. Collective."""
        at, area = self._contacts
        return self.grid.scatter(area * flux, at)[self.grid.own]

    def _correct(self, dt: float, conductance: Array) -> None:
        """Solve (C / dt + K + conductance (W/K) of the points) x = b into `_x`."""
        matrix, same = self._solver.matrix, PETSc.Mat.Structure.SAME_NONZERO_PATTERN
        self._conduction.copy(matrix, structure=same)
        matrix.axpy(1.0 / dt, self._capacity, same)
        self._add_coupling(matrix, conductance)
        matrix.assemble()
        self._solver.solve(self._b, self._x)

    def _add_coupling(self, matrix: PETSc.Mat, conductance: Array) -> None:
        """Add the conductance (W/K) of the points to the rows of this rank's surface nodes."""
        grid, entries = self.grid, []
        bands = grid.coupling(conductance, self._contacts.at)
        for distance, band in zip(grid.diagonals, bands, strict=True):
            lower = np.flatnonzero(band)
            entries.append((lower + distance, lower, band[lower]))
            if distance > 0:
                entries.append((lower, lower + distance, band[lower]))
        rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
        place = np.full(grid.n_nodes, -1)
        place[grid.own] = np.arange(grid.own.size)
        mine = np.flatnonzero(place[rows] >= 0)
        mine = mine[np.argsort(place[rows[mine]], kind="stable")]
        count = np.bincount(place[rows[mine]], minlength=grid.own.size)
        matrix.setValuesIJV(
            np.append(0, np.cumsum(count)).astype(PETSc.IntType),
            self._global_dof[columns[mine]],
            values[mine],
            addv=PETSc.InsertMode.ADD_VALUES,
            rowmap=self._global_dof[grid.own],
        )


class LaggedSolver:
    """Conjugate gradients for a `matrix` that changes, preconditioned by factors of an older one.

    They are kept as long as they serve: on the solves before it depends how long a solve takes.
    """

    def __init__(self, pattern: PETSc.Mat, dimension: int) -> None:
        """A matrix with the nonzeros of `pattern`."""
        self.matrix = pattern.duplicate(copy=True)
        self._iterations = 2 * PATIENCE
        self._ksp = ksp = PETSc.KSP().create(pattern.comm)
        ksp.setType("cg")
        ksp.setTolerances(rtol=1e-10, max_it=500)
        ksp.setOptionsPrefix("ice_")
        ksp.setOperators(self.matrix)
        factorise(ksp, dimension, "rcm")  # a slice's matrix is banded
        ksp.setFromOptions()

    def solve(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve with the present matrix. Collective. Raises NotConverged."""
        self._ksp.getPC().setReusePreconditioner(self._iterations <= PATIENCE)
        self._ksp.setOperators(self.matrix)
        self._iterations = 2 * PATIENCE  # what fails leaves no factors worth keeping
        if not solve(self._ksp, right, solution):
            raise NotConverged("the linear solver of the ice's temperature fails")
        self._iterations = self._ksp.getIterationNumber()
