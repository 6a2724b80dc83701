"""Heat conduction in the meshed ice below the contact: the `continuum` model.

The contact points lie anywhere on the ice's surface. Every rank knows the surface's grid: points
read their temperature from it by (bi)linear interpolation and give their heat to the same nodes
with the same weights, so that the heat that leaves the interface is the heat that enters the ice.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix

from iceslide_fem import _dolfinx
from iceslide_fem._dolfinx import MPI, PETSc, fem, ufl
from iceslide_fem.equilibrium import NotConverged
from iceslide_fem.film import FilmStage, IceSurface
from iceslide_fem.heat import FilmLaw
from iceslide_fem.materials import (
    ICE_CONDUCTIVITY,
    ICE_DENSITY,
    ICE_HEAT_CAPACITY,
    MELTING_TEMPERATURE,
    Array,
)
from iceslide_fem.meshing import IceMesh

# Where it melts, the surface is held at T_m through a resistance of this share of the first
# layer's: the flux is then a function of the point's temperature, and unique.
RESISTANCE_SHARE = 1e-3
MAX_ITERATIONS = 25
RELATIVE_RESIDUAL = 1e-8
# The factors of an older matrix precondition as long as they need no more iterations than this.
PATIENCE = 10


class Continuum:
    """Heat equation on the ice mesh, linear elements; content: T - T_0 at this rank's nodes.

    `area` (n,) is what each contact point stands for, m2 (m in a slice); it may change between
    steps as the rubber deforms.
    """

    def __init__(self, mesh: IceMesh, temperature: float, points: Array, area: Array) -> None:
        """Ice at `temperature` (K) under contact points at horizontal positions (n, d-1), m."""
        self._initial, self.area = temperature, area
        self.space = _dolfinx.scalar_space(mesh.mesh, 1)
        self.function = fem.Function(self.space, name="temperature")
        T, test = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        capacity = _dolfinx.form(ICE_DENSITY * ICE_HEAT_CAPACITY * T * test * ufl.dx)
        conduction = _dolfinx.form(
            ICE_CONDUCTIVITY * ufl.inner(ufl.grad(T), ufl.grad(test)) * ufl.dx
        )
        self._capacity = _dolfinx.assemble_matrix(_dolfinx.create_matrix(capacity), capacity)
        self._conduction = _dolfinx.assemble_matrix(_dolfinx.create_matrix(conduction), conduction)
        self._matrix = self._conduction.duplicate(copy=True)
        self._x, self._b = self._matrix.createVecs()
        self._work = self._b.duplicate()
        self._comm = mesh.mesh.comm
        self.resistance = RESISTANCE_SHARE * float(mesh.z[-1] - mesh.z[-2]) / ICE_CONDUCTIVITY
        self._find_surface(mesh)
        self._place(mesh, points)
        self._ksp = self._solver()
        self._iterations = 2 * PATIENCE

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns on all ranks."""
        return int(self.space.dofmap.index_map.size_global)

    def initial(self, n_points: int) -> Array:
        """Content of ice at its initial temperature (whatever the number of points)."""
        return np.zeros(self._x.getLocalSize())

    def surface_temperature(self, content: Array) -> Array:
        """Temperature at the contact points (K), shape (n,). Collective."""
        grid = np.zeros(self._global_dof.size)
        grid[self._own_grid] = content[self._own_dof]
        self._comm.Allreduce(MPI.IN_PLACE, grid, op=MPI.SUM)
        return self._initial + np.asarray((self._share * grid[self._node]).sum(axis=1))

    def stage(self, start: Array, dt: Array | float, film: FilmLaw) -> tuple[Array, FilmStage]:
        """Solve C (x - start) / dt + K x = heat from the film, with the film law. Collective.

        Newton's method: where a point melts, its flux depends on the temperature through
        `resistance`. Raises NotConverged if the set of melting points does not settle.
        """
        content = start.copy()
        resistance = np.full(self.area.shape, self.resistance)
        scale = 0.0
        for _ in range(MAX_ITERATIONS):
            offset = self.surface_temperature(content)
            result = film(
                IceSurface(offset, resistance, (MELTING_TEMPERATURE - offset) / resistance)
            )
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
            self._correct(float(dt), np.where(result.melting, self.area / resistance, 0.0))
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

    def _find_surface(self, mesh: IceMesh) -> None:
        """Number the surface's grid nodes; who owns them, and their dofs."""
        self._lines = [line for line in (mesh.x, mesh.y) if line.size]
        tags = mesh.facet_tags
        facets = tags.indices[tags.values == mesh.tags["surface"]]
        dim = mesh.mesh.topology.dim
        dofs = fem.locate_dofs_topological(self.space, dim - 1, facets)
        index_map = self.space.dofmap.index_map
        dofs = np.unique(dofs[dofs < index_map.size_local])
        positions = self.space.tabulate_dof_coordinates()[dofs]
        grid = np.zeros(dofs.size, dtype=np.int64)
        for axis, line in enumerate(self._lines):
            middle = 0.5 * (line[1:] + line[:-1])
            grid = grid * line.size + np.searchsorted(middle, positions[:, axis])
        self._own_dof, self._own_grid = dofs, grid
        n = int(np.prod([line.size for line in self._lines]))
        self._global_dof = np.full(n, -1, dtype=np.int64)
        self._global_dof[grid] = dofs + index_map.local_range[0]
        self._comm.Allreduce(MPI.IN_PLACE, self._global_dof, op=MPI.MAX)

    def _place(self, mesh: IceMesh, points: Array) -> None:
        """Nodes around every point and their interpolation weights, (n, 2^(d-1))."""
        cells, fractions = [], []
        for axis, line in enumerate(self._lines):
            x = np.clip(points[:, axis], line[0], line[-1])
            cell = np.clip(np.searchsorted(line, x) - 1, 0, line.size - 2)
            cells.append(cell)
            fractions.append((x - line[cell]) / (line[cell + 1] - line[cell]))
        nodes, shares = [], []
        for corner in itertools.product((0, 1), repeat=len(self._lines)):
            node = np.zeros(len(points), dtype=np.int64)
            share = np.ones(len(points))
            for axis, side in enumerate(corner):
                node = node * self._lines[axis].size + cells[axis] + side
                share = share * (fractions[axis] if side else 1.0 - fractions[axis])
            nodes.append(node)
            shares.append(share)
        self._node: NDArray[np.int64] = np.stack(nodes, axis=1)
        self._share = np.stack(shares, axis=1)

    def _solver(self) -> PETSc.KSP:
        ksp = PETSc.KSP().create(self._comm)
        ksp.setType("cg")
        ksp.setTolerances(rtol=1e-10, max_it=500)
        ksp.getPC().setType("lu")
        ksp.getPC().setFactorSolverType("mumps")
        ksp.setOptionsPrefix("ice_")
        ksp.setFromOptions()
        ksp.setOperators(self._matrix)
        return ksp

    def _load(self, flux: Array) -> Array:
        """Heat (W) that the contact points give to this rank's surface nodes."""
        grid = np.zeros(self._global_dof.size)
        np.add.at(grid, self._node, self._share * (self.area * flux)[:, None])
        self._comm.Allreduce(MPI.IN_PLACE, grid, op=MPI.SUM)
        return grid[self._own_grid]

    def _correct(self, dt: float, conductance: Array) -> None:
        """Solve (C / dt + K + conductance of the melting points) x = b into `_x`."""
        self._conduction.copy(self._matrix, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self._matrix.axpy(1.0 / dt, self._capacity, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        coupling = self._coupling(conductance)
        for grid in self._own_grid:
            row = slice(coupling.indptr[grid], coupling.indptr[grid + 1])
            if row.stop > row.start:
                columns = self._global_dof[coupling.indices[row]].astype(PETSc.IntType)
                self._matrix.setValues(
                    [self._global_dof[grid]],
                    columns,
                    coupling.data[row],
                    addv=PETSc.InsertMode.ADD_VALUES,
                )
        self._matrix.assemble()
        pc = self._ksp.getPC()
        pc.setReusePreconditioner(self._iterations <= PATIENCE)
        self._ksp.setOperators(self._matrix)
        self._ksp.solve(self._b, self._x)
        if self._ksp.getConvergedReason() < 0:
            raise NotConverged("the linear solver of the ice's temperature fails")
        self._iterations = self._ksp.getIterationNumber()

    def _coupling(self, conductance: Array) -> Any:
        """Sum over points of conductance * N N^T on the surface's grid nodes (CSR), all ranks."""
        wet = np.flatnonzero(conductance)
        node, share = self._node[wet], self._share[wet]
        values = conductance[wet][:, None, None] * share[:, :, None] * share[:, None, :]
        rows = np.broadcast_to(node[:, :, None], values.shape)
        columns = np.broadcast_to(node[:, None, :], values.shape)
        n = self._global_dof.size
        own = coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), (n, n)).tocsr()
        parts = self._comm.allgather(own)
        return sum(parts[1:], start=parts[0]).tocsr()
