"""The heat equation on a mesh, in DOLFINx.

    rho c dT/dt = div(lambda grad T) + f,   lambda dT/dn = q on the surface,   T = T_b on a base

that is held, and no heat through all other faces. With w the rise of T above one
temperature and the test functions v of the elements (`elements`),

    int rho c dw/dt v dx + int lambda grad w . grad v dx = int q v ds + int f v dx.

Unknowns are numbered column by column, downwards. Conduction is far stronger along a column than
sideways, so an incomplete Cholesky factor in this order is nearly exact. Systems of bodies that
melt are solved by conjugate gradients with the diagonal, on any number of ranks: some twenty
iterations (docs/explanation/ice.md). Their options begin with `-heat_`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, solve_linear, take_options
from iceslide_fem.heat.elements import LayeredElements, QuadraticElements, product
from iceslide_fem.mesh.gmsh_model import DistributedMesh
from iceslide_fem.mesh.regions import field_by_region
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import NotConverged
from iceslide_fem.scene.materials import Solid

Elements = LayeredElements | QuadraticElements


class Body(Protocol):
    """A DOLFINx mesh with named facets: that of the ice or of the rubber."""

    @property
    def mesh(self) -> Any:
        """The DOLFINx mesh."""

    @property
    def facet_tags(self) -> Any:
        """Numbers of facets."""

    @property
    def tags(self) -> Mapping[str, int]:
        """The number of each named set of facets."""


class Properties(NamedTuple):
    """Conductivity (W/(m K)) and heat capacity (J/(m3 K)), UFL expressions."""

    conductivity: Any
    heat_capacity: Any


class Conducting(NamedTuple):
    """Conduction between free unknowns, W/K, and the power from each into the held base, W."""

    matrix: PETSc.Mat
    drawn: Array


class HeatEquation:
    """Capacity, conduction and held base of a mesh, for this rank's unknowns.

    Arrays of unknowns are (n_own,), in the order of the elements' numbering; x: their positions, m;
    numbers: global numbers of the space's local dofs.
    capacity: of each unknown, J/K (J/(m K) in a slice); conduction: matrix, W/K, whose rows and
    columns of the held base are zero; drawn: power from each unknown into a base held at another
    rise than 0, W; held: mask of the base's unknowns; first_rise: at t = 0, K.
    """

    def __init__(
        self,
        body: Body,
        elements: Elements,
        properties: Properties,
        base: tuple[str, float] | None = None,
        first_rise: float = 0.0,
    ) -> None:
        """base: name of the held facets, and their rise (K). Collective."""
        self.body, self.elements, self.comm = body, elements, body.mesh.comm
        dofs, self.numbers = elements.numbering
        self.x = elements.space.tabulate_dof_coordinates()[dofs, : body.mesh.geometry.dim]
        self.capacity = elements.capacity(properties.heat_capacity)
        self._assembled = elements.stiffness(properties.conductivity)
        self.conduction = self._assembled()
        own = dofs.size
        self.held = np.zeros(own, dtype=bool)
        self.drawn, self.base_rise, self.first_rise = np.zeros(own), 0.0, first_rise
        if base is not None:
            self.base_rise = base[1]
            self.held = self._on(base[0])
            self.drawn = self._apart(self.conduction)
        leaks = product(self.conduction, (~self.held).astype(float))
        self._free_capacity = float(self.capacity[~self.held].sum())
        self._leak = float(leaks[~self.held].sum())  # conductance to the base, W/K

    @property
    def n_dofs(self) -> int:
        """Unknowns on all ranks."""
        return int(self.conduction.getSize()[0])

    def initial(self) -> Array:
        """Heat state at t = 0, K, with the held base."""
        return self.heat_state(np.where(self.held, self.base_rise, self.first_rise))

    def heat(self, heat_state: Array) -> float:
        """Heat since t = 0 without the base, J (J/m in a slice). Collective."""
        own = float(self.capacity @ np.where(self.held, 0.0, heat_state - self.first_rise))
        return float(self.comm.allreduce(own, op=MPI.SUM))

    def rise(self, heat_state: Array) -> Array:
        """Rise (K), (n_own,), of a heat state; equal to it for constant capacity."""
        return heat_state

    def heat_state(self, rise: Array) -> Array:
        """Heat state (K): the heat of a rise, over the initial capacity."""
        return rise

    def nodal(self, heat_state: Array) -> Array:
        """Rise (K) at all local dofs of the space, ghosts included. Collective."""
        return np.asarray(np.real(self.elements.values(self.rise(heat_state)).x.array))

    def steepness(self, rise: Array) -> Array:
        """Derivative of the heat state with the rise."""
        return np.ones_like(rise)

    def conducting(self, rise: Array) -> Conducting:
        """Conduction at a rise; constant here. Collective."""
        return Conducting(self.conduction, self.drawn)

    def warmed(self, power: Array, dt: float) -> Array:
        """Uniform rise (n_own,) of all free unknowns after `dt` (s) of the total `power` (W).

        Implicit Euler, as a stage. Collective.
        """
        own = np.array([power[~self.held].sum(), self._free_capacity / dt + self._leak])
        given, takes = self.comm.allreduce(own, op=MPI.SUM)
        return np.where(self.held, 0.0, given / takes)

    def _on(self, name: str) -> Mask:
        """Mask of the unknowns on the facets `name`, (n_own,). Collective."""
        space, tags = self.elements.space, self.body.facet_tags
        facets = tags.find(self.body.tags[name])
        here = fem.locate_dofs_topological(space, space.mesh.topology.dim - 1, facets)
        function = fem.Function(space)
        function.x.array[here] = 1.0
        compat.sum_ghosts(compat.petsc_vector(function))  # a dof's rank may have none of its facets
        return np.asarray(function.x.array[self.elements.numbering.dofs] > 0.5)

    def _apart(self, conduction: PETSc.Mat) -> Array:
        """Remove the held base from a matrix; return the power drawn from the other unknowns."""
        values = np.where(self.held, self.base_rise, 0.0)
        drawn = np.where(self.held, 0.0, product(conduction, values))
        rows = conduction.getOwnershipRange()[0] + np.flatnonzero(self.held)
        conduction.zeroRowsColumns(rows.astype(PETSc.IntType), diag=0.0)
        return drawn


def of_regions(body: DistributedMesh, solids: Mapping[str, Solid]) -> Properties:
    """Properties of a body with one of the `solids` in each region. Collective."""
    conductivity = {name: solid.conductivity for name, solid in solids.items()}
    capacity = {name: solid.density * solid.heat_capacity for name, solid in solids.items()}
    return Properties(field_by_region(body, conductivity), field_by_region(body, capacity))


MOST_ITERATIONS = 2000
RELATIVE = 1e-4  # relative residual; the next Newton iteration removes the rest


class LinearSolver:
    """Solves symmetric positive systems of one size."""

    def __init__(self, comm: Any, close: float) -> None:
        """`close`: absolute tolerance of the preconditioned residual, in the solution's unit."""
        self._vectors: tuple[PETSc.Vec, PETSc.Vec] | None = None
        self._ksp = ksp = PETSc.KSP().create(comm)
        ksp.setOptionsPrefix("heat_")
        ksp.setType("cg")
        ksp.setTolerances(rtol=RELATIVE, atol=close, max_it=MOST_ITERATIONS)
        ksp.getPC().setType("jacobi")
        take_options(ksp)

    @property
    def iterations(self) -> int:
        """Iterations for the last system."""
        return int(self._ksp.getIterationNumber())

    def solve(self, matrix: PETSc.Mat, right: Array) -> Array:
        """The solution (n_own,). Raises NotConverged. Collective."""
        if self._vectors is None:
            self._vectors = matrix.createVecs()
        load, solution = self._vectors
        load.array[:] = right
        self._ksp.setOperators(matrix)
        solve_linear(self._ksp, load, solution)
        if self._ksp.getConvergedReason() < 0:
            raise NotConverged("the linear solver of the heat equation fails")
        return np.array(solution.array)


def check_options(comm: Any) -> None:
    """Raise SceneError if PETSc does not know a value of an option `-heat_...`. Collective."""
    LinearSolver(comm, 1.0)
