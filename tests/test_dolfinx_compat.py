"""The functions of `compat` mean the same in every DOLFINx version and on any number of ranks."""

import logging

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import ufl  # noqa: E402
from dolfinx import fem  # noqa: E402
from dolfinx import mesh as dolfinx_mesh  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.mpi, pytest.mark.versions]

WORLD = MPI.COMM_WORLD
CELLS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]


def unit_mesh(name):
    kind = getattr(dolfinx_mesh.CellType, name)
    if name in ("triangle", "quadrilateral"):
        return dolfinx_mesh.create_unit_square(WORLD, 4, 3, kind)
    return dolfinx_mesh.create_unit_cube(WORLD, 3, 2, 2, kind)


def all_facets(mesh):
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    return dolfinx_mesh.exterior_facet_indices(mesh.topology)


@pytest.mark.parametrize("name", CELLS)
def test_spaces_have_the_expected_dofs(name):
    mesh = unit_mesh(name)
    dim = mesh.geometry.dim
    scalar, vector = compat.scalar_space(mesh, 2), compat.vector_space(mesh, 2)
    nodes = 9 * 7 if dim == 2 else 7 * 5 * 5
    assert scalar.dofmap.index_map.size_global == nodes
    assert vector.dofmap.index_map.size_global == nodes
    assert vector.dofmap.index_map_bs == dim
    assert compat.cell_name(mesh) == name


def corners_of_cells(mesh):
    """Coordinates of every cell's corners, ghosts included, as basix numbers them: (c, n, dim)."""
    space = compat.scalar_space(mesh, 1)
    return space.tabulate_dof_coordinates()[compat.cell_dofs(space), : mesh.geometry.dim]


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("degree", [1, 2])
def test_basix_element_numbers_dofs_as_the_space(name, degree):
    mesh = unit_mesh(name)
    dim = mesh.geometry.dim
    space = compat.scalar_space(mesh, degree)
    element = compat.basix_lagrange(name, degree)
    geometry = corners_of_cells(mesh)
    shape = compat.basix_lagrange(name, 1).tabulate(0, element.points)[0, :, :, 0]
    expected = np.einsum("qn,cnd->cqd", shape, geometry)
    dofs = compat.cell_dofs(space)
    np.testing.assert_allclose(space.tabulate_dof_coordinates()[dofs, :dim], expected, atol=1e-14)


@pytest.mark.parametrize("name", CELLS)
def test_every_outer_facet_is_paired_once(name):
    mesh = unit_mesh(name)
    dim = mesh.geometry.dim
    facets = all_facets(mesh)
    cells, local = compat.facet_cell_pairs(mesh, facets)
    element = compat.basix_lagrange(name, 1)
    corners = np.array([element.entity_closure_dofs[dim - 1][number] for number in local])
    geometry = corners_of_cells(mesh)
    if len(cells):
        facet_nodes = geometry[cells[:, None], corners.astype(int)]
        on_boundary = np.isclose(facet_nodes, 0.0) | np.isclose(facet_nodes, 1.0)
        assert on_boundary.all(axis=1).any(axis=1).all()
    count = {"triangle": 14, "quadrilateral": 14, "tetrahedron": 64, "hexahedron": 32}[name]
    assert WORLD.allreduce(len(cells)) == count


def test_no_facets_are_no_trouble():
    cells, local = compat.facet_cell_pairs(unit_mesh("hexahedron"), np.empty(0, dtype=np.int32))
    assert len(cells) == len(local) == 0


@pytest.mark.parametrize("name", CELLS)
def test_quadrature_integrates_its_degree(name):
    points, weights = compat.quadrature(name, 4)
    volume = {"triangle": 1 / 2, "tetrahedron": 1 / 6}.get(name, 1.0)
    fourth = {"triangle": 1 / 30, "tetrahedron": 1 / 210}.get(name, 1 / 5)
    assert weights.sum() == pytest.approx(volume)
    assert weights @ points[:, 0] ** 4 == pytest.approx(fourth)


def test_assembly_sums_over_ranks():
    mesh = unit_mesh("quadrilateral")
    space = compat.scalar_space(mesh, 2)
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    load, mass = compat.form(v * ufl.dx), compat.form(u * v * ufl.dx)
    vector, matrix = compat.create_vector(space), compat.create_matrix(mass)
    ones = compat.create_vector(space)
    ones.set(1.0)
    for _ in range(2):  # the second assembly overwrites the first
        compat.assemble_vector(vector, load)
        compat.assemble_matrix(matrix, mass)
    assert vector.sum() == pytest.approx(1.0)
    assert ones.dot(matrix * ones) == pytest.approx(1.0)
    assert (matrix * ones - vector).norm() == pytest.approx(0.0, abs=1e-15)


def test_constrained_rows_become_identity():
    mesh = unit_mesh("triangle")
    space = compat.vector_space(mesh, 1)
    facets = dolfinx_mesh.locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[0], 0.0))
    dofs = fem.locate_dofs_topological(space.sub(1), 1, facets)
    fixed = fem.dirichletbc(PETSc.ScalarType(0), dofs, space.sub(1))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    mass = compat.form(ufl.inner(u, v) * ufl.dx)
    matrix = compat.assemble_matrix(compat.create_matrix(mass), mass, [fixed])
    diagonal = matrix.getDiagonal().array
    owned = dofs[dofs < len(diagonal)]
    np.testing.assert_array_equal(diagonal[owned], 1.0)
    assert WORLD.allreduce(len(owned)) == 4


def test_petsc_vector_shares_the_functions_memory():
    function = fem.Function(compat.scalar_space(unit_mesh("triangle"), 1))
    vector = compat.petsc_vector(function)
    vector.set(3.0)
    compat.update_ghosts(vector)
    assert (function.x.array == 3.0).all()


def test_an_expression_is_interpolated():
    mesh = unit_mesh("quadrilateral")
    space = compat.scalar_space(mesh, 2)
    function = fem.Function(space)
    x = ufl.SpatialCoordinate(mesh)
    function.interpolate(compat.expression(x[0] * x[1], space))
    where = space.tabulate_dof_coordinates()
    np.testing.assert_allclose(function.x.array, where[:, 0] * where[:, 1], atol=1e-14)


def test_nan_survives_the_compiler():
    mesh = unit_mesh("quadrilateral")
    negative = fem.Constant(mesh, -1.0)
    value = compat.assemble_scalar(compat.form(ufl.ln(negative) * ufl.dx(mesh)), WORLD)
    assert np.isnan(value)


def test_compiling_says_nothing(caplog):
    mesh = unit_mesh("quadrilateral")
    caplog.set_level(logging.INFO)
    level = logging.getLogger().level
    factor = float(np.random.default_rng().random())  # a form that no cache knows
    compat.form(WORLD.bcast(factor) * ufl.dx(mesh))
    assert not caplog.records
    assert logging.getLogger().level == level
