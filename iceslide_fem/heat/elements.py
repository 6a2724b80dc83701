"""Elements of the heat equation: their unknowns and their quadrature.

`LayeredElements` are for bodies heated from a plane. They are quadratic downwards, where the
temperature falls steeply over a few layers. They are linear along the surface, where the heat of
films begins and ends suddenly. They form the subspace of DOLFINx's quadratic space in which a
mid-node along the surface has the mean of its neighbours. Quadrature points are the element's nodes
(trapezoids along the surface, Simpson downwards). The capacity is therefore diagonal and positive,
and sudden heat does not cool a node beside it. `QuadraticElements` are the whole space, for bodies
of any shape, also with a lumped capacity.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.runtime.arrays import Array, Index

NOTHING = 1e-12  # a weight below this is 0; weights have the sum 1


def rows_of(numbers: NDArray[np.int64], weights: Array, columns: int, comm: MPI.Comm) -> PETSc.Mat:
    """Matrix with rows (n, few) of weights for the columns `numbers`. Collective.

    columns: number of columns that this rank owns. Zero weights are dropped.
    """
    counts = np.abs(weights) > NOTHING
    starts = np.concatenate([[0], np.cumsum(counts.sum(axis=1))]).astype(PETSc.IntType)
    return PETSc.Mat().createAIJ(
        ((len(counts), PETSc.DETERMINE), (columns, PETSc.DETERMINE)),
        csr=(starts, numbers[counts].astype(PETSc.IntType), weights[counts]),
        comm=comm,
    )


def product(matrix: PETSc.Mat, values: Array) -> Array:
    """A matrix times this rank's `values`. Collective."""
    right, left = matrix.createVecs()
    right.array[:] = values
    matrix.mult(right, left)
    found = left.array.copy()
    right.destroy()
    left.destroy()
    return np.asarray(found)


DEGREE = 2
ROUNDED = 9  # digits, relative to the mesh size, for nodes in one column
LOBATTO = {"quadrature_rule": "GLL", "quadrature_degree": 3}


class Numbering(NamedTuple):
    """Unknowns of this rank as local dofs of the space, in order; and their global numbers.

    The global numbers are given for every local dof, ghosts included; -1 if it is no unknown.
    """

    dofs: Index
    number: NDArray[np.int64]


class QuadraticElements:
    """All of the quadratic Lagrange space on a mesh of any cells."""

    surface_degree = 2  # degree of shape functions on a facet

    def __init__(self, mesh: Any) -> None:
        """Number the unknowns column by column. Collective."""
        self.space = space = compat.scalar_space(mesh, DEGREE)
        own = np.arange(space.dofmap.index_map.size_local)
        self.numbering = numbered(space, own)
        self._rows = _rows(space, self.numbering.dofs)
        self._simplices = compat.cell_name(mesh) in ("triangle", "tetrahedron")

    def capacity(self, density: Any) -> Array:
        """Lumped capacity (n_own,) of a `density` (J/(m3 K)), a UFL expression. Collective.

        By nodal quadrature. In simplices nodal quadrature gives corners 0, so the diagonal is
        scaled instead (E. Hinton, T. Rock, O. C. Zienkiewicz, 1976).
        """
        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        dx = ufl.Measure("dx", domain=self.space.mesh)
        if not self._simplices:
            return self._own(compat.form(density * v * dx(metadata=LOBATTO)))
        mass = compat.form(density * u * v * dx)
        matrix = compat.assemble_matrix(compat.create_matrix(mass), mass)
        diagonal = matrix.getDiagonal()
        total = compat.assemble_scalar(compat.form(density * dx), self.space.mesh.comm)
        lumped = diagonal.array[self.numbering.dofs] * (total / diagonal.sum())
        matrix.destroy()
        return np.asarray(lumped)

    def stiffness(self, conductivity: Any) -> Callable[[], PETSc.Mat]:
        """Function that assembles the conduction matrix. Both calls are collective."""
        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        form = compat.form(conductivity * ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)
        whole = compat.create_matrix(form)

        def assembled() -> PETSc.Mat:
            matrix = compat.assemble_matrix(whole, form)
            return matrix.createSubMatrix(self._rows, self._rows)

        return assembled

    def load(self, density: Any) -> Array:
        """Power (W), (n_own,), of a source of this `density` (W/m3), UFL's. Collective."""
        v = ufl.TestFunction(self.space)
        return self._own(compat.form(density * v * ufl.dx(domain=self.space.mesh)))

    def summed(self, shares: Array) -> Array:
        """Sum of all ranks' contributions at this rank's unknowns, (n_own,). Collective.

        shares: contributions of this rank to all local dofs, ghosts included.
        """
        vector = compat.create_vector(self.space)
        with vector.localForm() as local:
            local.array[:] = shares
        compat.sum_ghosts(vector)
        values = vector.array[self.numbering.dofs].copy()
        vector.destroy()
        return np.asarray(values)

    def values(self, unknowns: Array) -> Any:
        """Function of the space with the `unknowns` (n_own,). Collective."""
        function = fem.Function(self.space)
        function.x.array[self.numbering.dofs] = unknowns
        function.x.scatter_forward()
        return function

    def _own(self, form: Any) -> Array:
        vector = compat.assemble_vector(compat.create_vector(self.space), form)
        values = vector.array[self.numbering.dofs].copy()
        vector.destroy()
        return np.asarray(values)


class LayeredElements:
    """Quadratic downwards and linear along the surface, in upright quads or hexahedra.

    The mesh is that of `mesh.ice_body`. halves: corners of the lower and the upper half of each
    cell of this rank, as VTK orders them, by local dofs of the space, (2 cells, 2^dim).
    """

    surface_degree = 1

    def __init__(self, mesh: Any) -> None:
        """Number the unknowns column by column. Collective."""
        self.space = space = compat.scalar_space(mesh, DEGREE)
        places = _places_of_dofs(compat.cell_name(mesh))
        cells = compat.cell_dofs(space)
        corner = (places[:, :-1] != 0.5).all(axis=1)
        kept = np.unique(cells[:, corner])
        own = space.dofmap.index_map.size_local
        self.numbering = numbered(space, kept[kept < own])
        self._spread = self._spreading(places, cells)
        owned = mesh.topology.index_map(mesh.topology.dim).size_local
        self.halves = cells[:owned][:, _halves(places)].reshape(-1, 2 ** places.shape[1])
        self._rule = _nodes_rule(places.shape[1])

    def capacity(self, density: Any) -> Array:
        """Capacity (n_own,) of a `density` (J/(m3 K)), a UFL expression. Collective."""
        return self.load(density)

    def stiffness(self, conductivity: Any) -> Callable[[], PETSc.Mat]:
        """Function that assembles the conduction matrix with the present coefficients.

        Both calls are collective.
        """
        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        dx = ufl.dx(domain=self.space.mesh, metadata=self._rule)
        form = compat.form(conductivity * ufl.inner(ufl.grad(u), ufl.grad(v)) * dx)
        whole = compat.create_matrix(form)

        def assembled() -> PETSc.Mat:
            return compat.assemble_matrix(whole, form).PtAP(self._spread)

        return assembled

    def load(self, density: Any) -> Array:
        """Power (W), (n_own,), of a source of this `density` (W/m3), UFL's. Collective."""
        v = ufl.TestFunction(self.space)
        form = compat.form(density * v * ufl.dx(domain=self.space.mesh, metadata=self._rule))
        whole = compat.assemble_vector(compat.create_vector(self.space), form)
        unknowns = self._spread.createVecRight()
        self._spread.multTranspose(whole, unknowns)
        values = unknowns.array.copy()
        whole.destroy()
        unknowns.destroy()
        return np.asarray(values)

    def values(self, unknowns: Array) -> Any:
        """Function of the space with the `unknowns` (n_own,). Collective."""
        function = fem.Function(self.space)
        right, left = self._spread.createVecs()
        right.array[:] = unknowns
        self._spread.mult(right, left)
        function.x.array[: left.array.size] = left.array
        function.x.scatter_forward()
        right.destroy()
        left.destroy()
        return function

    def _spreading(self, places: Array, cells: NDArray[np.int32]) -> PETSc.Mat:
        """Matrix from the unknowns to all dofs of the space that this rank owns."""
        corners = [
            [np.flatnonzero((places == end).all(axis=1))[0] for end in _ends(place)]
            for place in places
        ]
        most = max(map(len, corners))
        parents = np.array([one * (most // len(one)) for one in corners])  # repeated
        own, number = self.space.dofmap.index_map.size_local, self.numbering.number
        columns = np.zeros((own, most), dtype=np.int64)
        for dof, parent in enumerate(parents):
            some = cells[:, dof] < own
            columns[cells[some, dof]] = number[cells[some][:, parent]]
        rows = np.repeat(np.arange(own), most)
        first, last = np.full(most, 1.0 / most), self.numbering.dofs.size
        spread = coo_matrix((np.tile(first, own), (rows, columns.ravel())))
        spread = spread.tocsr()  # sums duplicate entries
        return PETSc.Mat().createAIJ(
            ((own, PETSc.DETERMINE), (last, PETSc.DETERMINE)),
            csr=(
                spread.indptr.astype(PETSc.IntType),
                spread.indices.astype(PETSc.IntType),
                spread.data,
            ),
            comm=self.space.mesh.comm,
        )


def numbered(space: Any, own: Index) -> Numbering:
    """The `own` local dofs numbered column by column, each from its top. Collective."""
    comm, dim = space.mesh.comm, space.mesh.geometry.dim
    x = space.tabulate_dof_coordinates()[own, :dim]
    ends = np.array([-x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    places = np.round(x / ends.sum(axis=0).max(), ROUNDED)
    *across, depth = places.T
    dofs = own[np.lexsort([-depth, *across[::-1]])]
    function = fem.Function(space)
    function.x.array[:] = -1.0
    before = comm.scan(dofs.size) - dofs.size
    function.x.array[dofs] = before + np.arange(dofs.size)
    function.x.scatter_forward()
    return Numbering(dofs, np.rint(np.real(function.x.array)).astype(np.int64))


def _rows(space: Any, dofs: Index) -> PETSc.IS:
    first = space.dofmap.index_map.local_range[0]
    return PETSc.IS().createGeneral((first + dofs).astype(PETSc.IntType), comm=space.mesh.comm)


def _places_of_dofs(cell: str) -> Array:
    """Reference positions of the dofs of a quadratic cell, (dofs, dim): 0, 0.5 or 1 each."""
    return np.round(2.0 * np.asarray(compat.basix_lagrange(cell, DEGREE).points)) / 2.0


def _ends(place: Array) -> list[Array]:
    """Positions whose mean gives a dof: itself, or its neighbours along the surface."""
    *across, down = [[x] for x in place]
    choices = [[0.0, 1.0] if axis == [0.5] else axis for axis in across]
    return [np.array([*along, *down]) for along in itertools.product(*choices)]


def _halves(places: Array) -> NDArray[np.intp]:
    """Dofs (2, 2^dim) at the corners of a cell's halves, as VTK orders them."""
    around = [[0.0], [1.0]] if places.shape[1] == 2 else [[0, 0], [1, 0], [1, 1], [0, 1]]
    halves = []
    for low, high in ((0.0, 0.5), (0.5, 1.0)):
        upper = around[::-1] if places.shape[1] == 2 else around  # VTK: quadrilaterals go around
        ends = [[*place, low] for place in around] + [[*place, high] for place in upper]
        halves.append([np.flatnonzero((places == end).all(axis=1))[0] for end in ends])
    return np.array(halves)


def _nodes_rule(dim: int) -> dict[str, Any]:
    """Trapezoids along the surface, Simpson's rule downwards, on the reference cell."""
    ends, simpson = [(0.0, 0.5), (1.0, 0.5)], [(0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6)]
    product = list(itertools.product(*[ends] * (dim - 1), simpson))
    points = tuple(tuple(axis[0] for axis in point) for point in product)
    weights = tuple(math.prod(axis[1] for axis in point) for point in product)
    return {
        "quadrature_rule": "custom",
        "quadrature_points": points,
        "quadrature_weights": weights,
    }
