"""The heat equation on a mesh in quadratic elements, by DOLFINx.

    rho c dT/dt = div(lambda grad T) + f,   lambda dT/dn = q on the surface,   T = T_b on a held base

and no heat through all other faces. With w the rise of T above the initial temperature, and v the
test functions of the quadratic Lagrange space,

    int rho c dw/dt v dx + int lambda grad w . grad v dx = int q v ds + int f v dx.

The capacity is integrated by the Gauss-Lobatto rule whose points are the element's nodes, so that
its matrix is diagonal, and all its entries are positive (Simpson's rule along each axis). The
order in space stays, and fluxes that begin suddenly cool no node beside them as much as those of
the full matrix (docs/theory.md).

Unknowns are numbered column by column: nodes below one another follow each other downwards. Heat
goes up and down far faster than sideways, and an incomplete Cholesky factor in that order is nearly
the factor itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array, Index
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.materials import Solid
from iceslide_fem.mesh.gmsh_model import DistributedMesh

DEGREE = 2
LOBATTO = {"quadrature_rule": "GLL", "quadrature_degree": 2 * DEGREE - 1}
ROUNDED = 9  # digits of a mesh's size to which nodes are below one another


class HeatEquation:
    """Capacity, conduction and the held base of a mesh, in this rank's own unknowns.

    Arrays of unknowns are (n_own,), in the order of `dofs`, the numbers of the space's local dofs.
    capacity: of each unknown, J/K (J/(m K) in a slice); conduction: matrix, W/K, whose rows and
    columns of the held base are zero; drawn: power that leaves each unknown towards a base that
    is held at another temperature than the initial, W; held: which unknowns the base has.
    """

    def __init__(
        self,
        body: DistributedMesh,
        solids: Mapping[str, Solid],
        base: tuple[str, float] | None = None,
    ) -> None:
        """`solids`: of the body's regions; `base`: name of facets that are held, and by how much
        (K) they are warmer than the initial temperature. Collective.
        """
        self.body, self.comm = body, body.mesh.comm
        self.space = space = compat.scalar_space(body.mesh, DEGREE)
        own = space.dofmap.index_map.size_local
        self.x = space.tabulate_dof_coordinates()[:own, : body.mesh.geometry.dim]
        self.dofs = _downwards(self.x, self.comm)
        self.x = self.x[self.dofs]
        self._conductivity, heat_capacity = _of_cells(body, solids)
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        dx = ufl.Measure("dx", domain=body.mesh)
        mass = compat.form(heat_capacity * v * dx(metadata=LOBATTO))
        stiffness = compat.form(self._conductivity * ufl.inner(ufl.grad(u), ufl.grad(v)) * dx)
        lumped = compat.assemble_vector(compat.create_vector(space), mass)
        self.capacity = lumped.array[self.dofs].copy()
        whole = compat.assemble_matrix(compat.create_matrix(stiffness), stiffness)
        first = space.dofmap.index_map.local_range[0]
        rows = PETSc.IS().createGeneral((first + self.dofs).astype(PETSc.IntType), comm=self.comm)
        self.conduction = whole.createSubMatrix(rows, rows)
        whole.destroy()
        lumped.destroy()
        self.first = self.conduction.getOwnershipRange()[0]
        self.numbers = self._numbers()
        self.held = np.zeros(own, dtype=bool)
        self.drawn, self.base_rise = np.zeros(own), 0.0
        if base is not None:
            self._hold(*base)
        self.conduction.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        ones, leaks = self.conduction.createVecs()
        ones.array[:] = ~self.held
        self.conduction.mult(ones, leaks)
        self._free_capacity = float(self.capacity[~self.held].sum())
        self._leak = float(leaks.array[~self.held].sum())  # to the base, W/K

    @property
    def n_dofs(self) -> int:
        """Unknowns on all ranks."""
        return int(self.conduction.getSize()[0])

    def initial(self) -> Array:
        """Rise at t = 0, K: none but of the held base."""
        return np.where(self.held, self.base_rise, 0.0)

    def heat(self, rise: Array) -> float:
        """Heat above the initial temperature, J (J/m in a slice), without the base's. Collective."""
        own = float(self.capacity @ np.where(self.held, 0.0, rise))
        return float(self.comm.allreduce(own, op=MPI.SUM))

    def warmed(self, power: Array, dt: float) -> Array:
        """Rise (n_own,) of all but the held base, equal everywhere, after `dt` (s) of the `power`
        (W) of all unknowns, implicit as a stage. Collective.
        """
        own = np.array([power[~self.held].sum(), self._free_capacity / dt + self._leak])
        given, takes = self.comm.allreduce(own, op=MPI.SUM)
        return np.where(self.held, 0.0, given / takes)

    def function(self, rise: Array) -> Any:
        """`rise` as a function of DOLFINx, ghosts included. Collective."""
        function = fem.Function(self.space)
        function.x.array[self.dofs] = rise
        function.x.scatter_forward()
        return function

    def load(self, density: Any) -> Array:
        """Power (W) that a source of this `density` (W/m3), a UFL expression, gives. Collective."""
        test = ufl.TestFunction(self.space)
        form = compat.form(density * test * ufl.dx(domain=self.body.mesh))
        vector = compat.assemble_vector(compat.create_vector(self.space), form)
        power = vector.array[self.dofs].copy()
        vector.destroy()
        return np.asarray(power)

    def _numbers(self) -> NDArray[np.int64]:
        """Number among all unknowns of each local dof of the space, ghosts included. Collective."""
        function = fem.Function(self.space)
        function.x.array[self.dofs] = self.first + np.arange(self.dofs.size)
        function.x.scatter_forward()
        return np.rint(np.real(function.x.array)).astype(np.int64)

    def _hold(self, name: str, rise: float) -> None:
        """Hold the facets `name` at `rise` (K): their rows and columns leave the matrix."""
        mesh = self.body.mesh
        facets = self.body.facet_tags.find(self.body.tags[name])
        here = fem.locate_dofs_topological(self.space, mesh.topology.dim - 1, facets)
        function = fem.Function(self.space)
        function.x.array[here] = 1.0
        # a rank may have a node of the base without a facet of it
        vector = compat.petsc_vector(function)
        compat.sum_ghosts(vector)
        self.held = function.x.array[self.dofs] > 0.5
        self.base_rise = rise
        values, drawn = self.conduction.createVecs()
        values.array[:] = np.where(self.held, rise, 0.0)
        self.conduction.mult(values, drawn)
        self.drawn = np.where(self.held, 0.0, drawn.array)
        rows = (self.first + np.flatnonzero(self.held)).astype(PETSc.IntType)
        self.conduction.zeroRowsColumns(rows, diag=0.0)


def _downwards(x: Array, comm: MPI.Comm) -> Index:
    """Order of nodes (n, d), m, column by column, each from its top. Collective."""
    ends = np.array([-x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    places = np.round(x / ends.sum(axis=0).max(), ROUNDED)
    *across, depth = places.T
    return np.lexsort([-depth, *across[::-1]])


def _of_cells(body: DistributedMesh, solids: Mapping[str, Solid]) -> tuple[Any, Any]:
    """Conductivity (W/(m K)) and heat capacity (J/(m3 K)) of the cells, ghosts included."""
    space = compat.cellwise_space(body.mesh)
    conductivity, capacity = fem.Function(space), fem.Function(space)
    for name, solid in solids.items():
        cells = body.cell_tags.find(body.regions[name])
        dofs = compat.cell_dofs(space)[cells, 0]
        conductivity.x.array[dofs] = solid.conductivity
        capacity.x.array[dofs] = solid.density * solid.heat_capacity
    for function in (conductivity, capacity):
        function.x.scatter_forward()
    return conductivity, capacity
