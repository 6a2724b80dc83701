"""Every difference between DOLFINx 0.5.2 and 0.11, and nothing else.

The rest of the package imports DOLFINx from here (`from iceslide_fem.fenics.compat import MPI,
PETSc, fem, ufl`). This module first loads the start-up module of the PyPI wheel, if there is one,
and it lets only one process compile at a time (`jit`). Names that are equal in all versions
(`fem.Function`, `fem.dirichletbc`, `ufl.Measure`, ...) have no function here.
"""

from __future__ import annotations

import functools
import inspect
import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

try:  # the PyPI wheel has to load its own MPI before anything else does
    import dolfinx_solver
except ImportError:
    dolfinx_solver = None

import basix
import dolfinx
import numpy as np
import ufl
from dolfinx import fem, io, jit
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from iceslide_fem.fenics.cache import cache_folder, processor
from iceslide_fem.fenics.jit import compile_alone, failing_in_one_sentence
from iceslide_fem.runtime.errors import SceneError

IntArray = NDArray[np.int32]
FloatArray = NDArray[np.float64]

VERSION: str = dolfinx.__version__

# These flags let the compiler vectorise sums; a tangent assembles up to twice as fast. Unlike
# -ffast-math they keep NaN and infinity, by which Newton detects an inverted element.
COMPILER_FLAGS = [
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fassociative-math",
    "-fno-signed-zeros",
    "-g0",
]
_HAS_BASIX_UFL = hasattr(fem, "functionspace")  # since 0.7
COMPILED = cache_folder() / f"forms-{processor()}"  # native code of one processor
_JIT_DEFAULTS = (
    jit.DOLFINX_DEFAULT_JIT_OPTIONS
    if hasattr(jit, "DOLFINX_DEFAULT_JIT_OPTIONS")  # since 0.6
    else jit.DOLFINX_DEFAULT_JIT_PARAMETERS
)
_JIT_DEFAULTS["cache_dir"] = (COMPILED, _JIT_DEFAULTS["cache_dir"][-1])


@contextmanager
def _unchanged(objects: list[Any]) -> Iterator[None]:
    """Protect the meshes of forms: FFCx 0.5 changes their coordinate elements in place.

    It does so only on the rank that compiles. The names of later forms, and their cache files,
    would then differ between ranks.
    """
    forms = [part for part in objects if isinstance(part, ufl.Form)] if not _HAS_BASIX_UFL else []
    domains = {id(domain): domain for form in forms for domain in form.ufl_domains()}.values()
    elements = [domain.ufl_coordinate_element() for domain in domains]
    try:
        yield
    finally:
        for domain, element in zip(domains, elements, strict=True):
            domain._ufl_coordinate_element = element


compile_alone(COMPILED, _unchanged)


@failing_in_one_sentence
def scalar_space(mesh: Any, degree: int) -> Any:
    """Continuous Lagrange space of scalars of the given degree."""
    if _HAS_BASIX_UFL:
        return fem.functionspace(mesh, ("Lagrange", degree))
    return fem.FunctionSpace(mesh, ("Lagrange", degree))


@failing_in_one_sentence
def vector_space(mesh: Any, degree: int) -> Any:
    """Continuous Lagrange space of vectors with the dimension of the mesh."""
    if _HAS_BASIX_UFL:
        return fem.functionspace(mesh, ("Lagrange", degree, (mesh.geometry.dim,)))
    return fem.VectorFunctionSpace(mesh, ("Lagrange", degree))


@failing_in_one_sentence
def cellwise_space(mesh: Any) -> Any:
    """Space of one constant per cell."""
    if _HAS_BASIX_UFL:
        return fem.functionspace(mesh, ("DG", 0))
    return fem.FunctionSpace(mesh, ("DG", 0))


@failing_in_one_sentence
def polynomial_space(mesh: Any, degree: int) -> Any:
    """Discontinuous complete polynomials of the given degree in quadrilaterals or hexahedra.

    They are fewer than in a Lagrange space: 1, x, y, z for degree 1.
    """
    if _HAS_BASIX_UFL:
        return fem.functionspace(mesh, ("DPC", degree))
    return fem.FunctionSpace(mesh, ("DPC", degree))


@failing_in_one_sentence
def quadrature_space(mesh: Any, degree: int, components: int) -> Any:
    """Space of `components` values at each point of the default rule of a degree."""
    if _HAS_BASIX_UFL:
        from basix.ufl import quadrature_element

        element = quadrature_element(cell_name(mesh), (components,), degree=degree)
        return fem.functionspace(mesh, element)
    cell = mesh.ufl_cell()
    element = ufl.VectorElement("Quadrature", cell, degree, components, quad_scheme="default")
    return fem.FunctionSpace(mesh, element)


@failing_in_one_sentence
def form(expression: Any) -> Any:
    """Compile a UFL form (or a list of them) for this machine's processor."""
    options = {"cffi_extra_compile_args": COMPILER_FLAGS}
    if _HAS_BASIX_UFL:
        return fem.form(expression, jit_options=options)
    return fem.form(expression, jit_params=options)


@failing_in_one_sentence
def expression(value: Any, space: Any) -> Any:
    """`fem.Expression` of a UFL expression at the interpolation points of `space`."""
    points = space.element.interpolation_points
    return fem.Expression(value, points() if callable(points) else points)


@failing_in_one_sentence
def at_points(value: Any, points: FloatArray) -> Any:
    """`fem.Expression` of a UFL expression at `points` (q, d) of the reference cell, compiled for
    this machine's processor.
    """
    options = {"cffi_extra_compile_args": COMPILER_FLAGS}
    if _HAS_BASIX_UFL:
        return fem.Expression(value, points, jit_options=options)
    return fem.Expression(value, points, jit_params=options)


def evaluated(expression: Any, mesh: Any, cells: IntArray) -> FloatArray:
    """Values (c, q, ...) in one row for each of the local `cells` (c, n)."""
    if len(inspect.signature(type(expression).eval).parameters) > 3:  # since 0.6
        return np.asarray(expression.eval(mesh, cells))
    return np.asarray(expression.eval(cells))


def create_vector(space: Any) -> PETSc.Vec:
    """Zero PETSc vector with ghosts, laid out as the dofs of `space`."""
    index_map, block_size = space.dofmap.index_map, space.dofmap.index_map_bs
    sizes = (index_map.size_local * block_size, index_map.size_global * block_size)
    return PETSc.Vec().createGhost(
        index_map.ghosts.astype(PETSc.IntType),
        size=sizes,
        bsize=block_size,
        comm=space.mesh.comm,
    )


def create_matrix(bilinear_form: Any, kind: str | None = None) -> PETSc.Mat:
    """PETSc matrix, of PETSc's default `kind` or another, with the sparsity of a bilinear form."""
    return fem_petsc.create_matrix(bilinear_form, kind)


def assemble_vector(vector: PETSc.Vec, linear_form: Any) -> PETSc.Vec:
    """Overwrite `vector` with the assembled linear form; ghost contributions are summed."""
    assemble_shares(vector, linear_form)
    sum_ghosts(vector)
    return vector


def assemble_shares(vector: PETSc.Vec, linear_form: Any) -> None:
    """Overwrite `vector` with this rank's part of the linear form, ghosts not yet summed."""
    with vector.localForm() as local:
        local.set(0.0)
    fem_petsc.assemble_vector(vector, linear_form)


def assemble_matrix(
    matrix: PETSc.Mat, bilinear_form: Any, conditions: Sequence[Any] = ()
) -> PETSc.Mat:
    """Overwrite `matrix` with the assembled bilinear form; constrained rows become identity."""
    matrix.zeroEntries()
    fem_petsc.assemble_matrix(matrix, bilinear_form, list(conditions))
    matrix.assemble()
    return matrix


def assemble_scalar(functional: Any, comm: MPI.Comm) -> float:
    """Value of a compiled functional, summed over all ranks."""
    return float(comm.allreduce(fem.assemble_scalar(functional), op=MPI.SUM))


def sum_ghosts(vector: PETSc.Vec) -> None:
    """Add the ghost entries of `vector` to their owners (after assembly)."""
    vector.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)


def update_ghosts(vector: PETSc.Vec) -> None:
    """Copy the owners' values to the ghost entries of `vector` (before using it locally)."""
    vector.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)


def petsc_vector(function: Any) -> PETSc.Vec:
    """PETSc vector that shares memory with a Function's values."""
    return function.x.petsc_vec if hasattr(function.x, "petsc_vec") else function.vector


def cell_name(mesh: Any) -> str:
    """Name of the cells: triangle, quadrilateral, tetrahedron or hexahedron."""
    return str(mesh.topology.cell_name())


def cell_dofs(space: Any) -> IntArray:
    """Blocked dofs of every cell, ghosts included: (cells, dofs per cell)."""
    return _as_rows(space.dofmap.list, space.dofmap.dof_layout.num_dofs)


def facet_cell_pairs(mesh: Any, facets: IntArray) -> tuple[IntArray, IntArray]:
    """Cell of each exterior facet and the facet's number in it, for the cells this rank owns.

    Every exterior facet appears on exactly one rank: the owner of its cell. Facets of ghost
    cells are dropped, so both arrays may be shorter than `facets` or empty.
    """
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    mesh.topology.create_connectivity(dim, dim - 1)
    facet_to_cell = mesh.topology.connectivity(dim - 1, dim)
    cell_to_facet = mesh.topology.connectivity(dim, dim - 1)
    facets = np.asarray(facets, dtype=np.int32)
    cells = facet_to_cell.array[facet_to_cell.offsets[facets]]
    owned = cells < mesh.topology.index_map(dim).size_local
    cells, facets = cells[owned], facets[owned]
    columns = len(cell_to_facet.array) // max(_local_cells(mesh), 1)
    local = _as_rows(cell_to_facet.array, max(columns, 1))[cells] == facets[:, None]
    return cells, local.argmax(axis=1).astype(np.int32)


def midpoints(mesh: Any, facets: IntArray) -> FloatArray:
    """Midpoints (n, 3) of facets with these local numbers."""
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    return np.array(
        dolfinx.mesh.compute_midpoints(mesh, dim - 1, np.asarray(facets, dtype=np.int32))
    ).reshape(-1, 3)


def cell_midpoints(mesh: Any) -> FloatArray:
    """Midpoints (n, 3) of the cells that this rank owns."""
    dim = mesh.topology.dim
    owned = np.arange(mesh.topology.index_map(dim).size_local, dtype=np.int32)
    return np.array(dolfinx.mesh.compute_midpoints(mesh, dim, owned)).reshape(-1, 3)


def cell_measure(mesh: Any, kinds: IntArray) -> Any:
    """Measure over cells; subdomain k has the cells of this rank with kind k in `kinds` (n,)."""
    numbers = np.arange(len(kinds), dtype=np.int32)
    tags = dolfinx.mesh.meshtags(mesh, mesh.topology.dim, numbers, kinds.astype(np.int32))
    return ufl.Measure("dx", domain=mesh, subdomain_data=tags)


def measured_cell(measure: Any) -> str:
    """Name of the cells of a `cell_measure`."""
    return str(measure.ufl_domain().ufl_cell()).split()[0]


def open_xdmf(path: Path, in_hdf5: bool) -> Any:
    """The XDMF file of mesh and tags at `path` for this rank; in_hdf5: where its numbers are."""
    encodings = io.XDMFFile.Encoding
    encoding = encodings.HDF5 if in_hdf5 else encodings.ASCII
    return io.XDMFFile(MPI.COMM_SELF, str(path), "r", encoding)


def entity_corners(mesh: Any, dim: int, entities: IntArray) -> IntArray:
    """Geometry nodes (entities, corners) of entities of a dimension, in DOLFINx's order."""
    mesh.topology.create_connectivity(dim, mesh.topology.dim)
    if hasattr(dolfinx.mesh, "entities_to_geometry"):  # since 0.9
        return np.asarray(dolfinx.mesh.entities_to_geometry(mesh, dim, entities))
    own = mesh._mesh if hasattr(mesh, "_mesh") else mesh._cpp_object  # 0.5, later
    return np.asarray(dolfinx.cpp.mesh.entities_to_geometry(own, dim, entities, False))


def basix_lagrange(name: str, degree: int) -> Any:
    """Basix element with the dof numbering of the spaces above.

    Has `tabulate(derivatives, points)` -> (1 + dim, points, dofs, 1) and `entity_closure_dofs`.
    Valid up to degree 2: from degree 3 on, dofs are permuted on edges and faces.
    """
    return basix.create_element(
        basix.ElementFamily.P,
        getattr(basix.CellType, name),
        degree,
        basix.LagrangeVariant.gll_warped if degree > 0 else basix.LagrangeVariant.unset,
    )


def quadrature(name: str, degree: int) -> tuple[FloatArray, FloatArray]:
    """Points (n, dim) and weights (n,) of the default rule on the reference cell."""
    points, weights = basix.make_quadrature(getattr(basix.CellType, name), degree)
    return np.array(points), np.array(weights)


@failing_in_one_sentence
def mesh_from_gmsh(
    model: Any, comm: MPI.Comm, rank: int, gdim: int, owners: Callable[[Any], IntArray]
) -> tuple[Any, Any, Any]:
    """Distribute the gmsh model of one rank: (mesh, cell tags, facet tags).

    `model` is used on `rank` only. Its nodes must be numbered from 1 without gaps, and each cell
    must be in one physical group. `owners` returns the rank of each cell from the cells' nodes,
    counted from 0 in one array.
    """
    try:
        from dolfinx.io import gmsh as reader
    except ImportError:  # before 0.10
        from dolfinx.io import gmshio

        if "partitioner" in inspect.signature(gmshio.model_to_mesh).parameters:  # since 0.6
            return gmshio.model_to_mesh(model, comm, rank, gdim, _partitioner(owners))
        making = functools.partial(gmshio.create_mesh, partitioner=_partitioner(owners))
        with mock.patch.object(gmshio, "create_mesh", making):
            return gmshio.model_to_mesh(model, comm, rank, gdim)
    data = reader.model_to_mesh(model, comm, rank, gdim, _partitioner(owners))
    return data.mesh, data.cell_tags, data.facet_tags


def _partitioner(owners: Callable[[IntArray], IntArray]) -> Callable[..., Any]:
    """Partitioner for DOLFINx: ranks of cells from their nodes on this rank."""

    def partition(comm: Any, ranks: int, dim: Any, cells: Any, *ghosted: Any) -> Any:
        cells = cells[0] if isinstance(cells, list) else cells  # several kinds of them since 0.8
        nodes = np.asarray(getattr(cells, "array", cells))
        found = owners(nodes)
        lists = [[int(owner)] for owner in found]
        if ghosted and lists:  # before 0.6 shared nodes are found by these cells only
            nodes = nodes.reshape(len(lists), -1)
            touching = np.zeros((nodes.max() + 1, ranks), dtype=bool)
            touching[nodes, found[:, None]] = True
            of_facet = nodes.shape[1] // 2 if nodes.shape[1] == 2**dim else dim
            for cell, other in np.argwhere(touching[nodes].sum(axis=1) >= of_facet):
                if other != found[cell]:
                    lists[cell].append(int(other))
        ends = np.cumsum([0, *map(len, lists)], dtype=np.int32)
        ranks_of_cells = np.array(list(itertools.chain(*lists)), dtype=np.int32)
        return dolfinx.cpp.graph.AdjacencyList_int32(ranks_of_cells, ends)

    return partition


def _local_cells(mesh: Any) -> int:
    cells = mesh.topology.index_map(mesh.topology.dim)
    return int(cells.size_local + cells.num_ghosts)


def _as_rows(table: Any, columns: int) -> IntArray:
    # an adjacency list in early versions, an array later
    return np.asarray(getattr(table, "array", table), dtype=np.int32).reshape(-1, columns)


def solve_linear(ksp: PETSc.KSP, right: PETSc.Vec, solution: PETSc.Vec) -> None:
    """Solve with `ksp`. Raises the errors of a Python preconditioner. Collective."""
    try:
        ksp.solve(right, solution)
    except PETSc.Error as error:  # since 3.22 petsc4py has it as the cause of its own
        if error.__cause__ is not None:
            raise error.__cause__ from None
        raise


def take_options(ksp: PETSc.KSP) -> None:
    """Apply the user's options to `ksp`. Collective.

    Raises SceneError on all ranks if PETSc rejects a value.
    """
    try:
        ksp.setFromOptions()
    except PETSc.Error as error:
        reason = str(error).strip().splitlines()[-1].partition("] ")[2]
        raise SceneError(
            f"PETSc does not take the options -{ksp.getOptionsPrefix()}...: {reason}"
        ) from None
