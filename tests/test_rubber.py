"""HyperelasticBody: stress from energy, tangent, closed forms and convergence."""

import functools

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import sympy  # noqa: E402
import ufl  # noqa: E402
from blocks import CELLS, SIZE, a_block, all_of, bend  # noqa: E402
from dolfinx import fem  # noqa: E402
from dolfinx import mesh as dolfinx_mesh  # noqa: E402
from scipy.optimize import brentq  # noqa: E402

from iceslide_fem import reference  # noqa: E402
from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.fenics.compat import PETSc  # noqa: E402
from iceslide_fem.mechanics.element import SPLIT, WHOLE, WHOLE_DEGREE, energy_density  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS, MooneyRivlin  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.mpi, pytest.mark.versions]

B = COMPOUNDS["B"]
STIFF = MooneyRivlin(B.C10, B.C01, 1e-5 * B.D1)  # as good as incompressible


@functools.cache
def energy_and_stress():
    """W and the first Piola stress P = dW/dF as functions of F (3, 3), C10, C01, D1, by SymPy."""
    F = sympy.Matrix(3, 3, sympy.symbols("F:9"))
    C10, C01, D1 = constants = sympy.symbols("C10 C01 D1")
    J, C = F.det(), F.T * F
    I1, I2 = C.trace(), (C.trace() ** 2 - (C * C).trace()) / 2
    third = sympy.Rational(1, 3)
    W = C10 * (J ** (-2 * third) * I1 - 3) + C01 * (J ** (-4 * third) * I2 - 3) + (J - 1) ** 2 / D1
    P = W.diff(F)
    return [sympy.lambdify([tuple(F), *constants], value) for value in (W, P)]


def stress(F, material):
    """First Piola stress (3, 3) of the deformation gradient F (3, 3), Pa."""
    P = energy_and_stress()[1](F.ravel(), material.C10, material.C01, material.D1)
    return np.asarray(P, dtype=float).reshape(3, 3)


def uniform(rubber, F):
    """Deform `rubber` by a constant F (d, d); returns its mean stress by virtual work."""
    dim = rubber.mesh.geometry.dim
    X = rubber.space.tabulate_dof_coordinates()[:, :dim]
    rubber.displacements[:] = X @ (F - np.eye(dim)).T
    forces = rubber.create_vector()
    rubber.internal_forces(forces)
    compat.sum_ghosts(forces)
    owned = forces.array.reshape(-1, dim)
    # sum_a f_a . (G X_a) = V P : G for every constant G
    return rubber.mesh.comm.allreduce(owned.T @ X[: len(owned)]) / SIZE**dim


@pytest.mark.parametrize("cells", CELLS)
def test_stress_is_the_derivative_of_the_energy(cells):
    rubber = HyperelasticBody(a_block(cells, 2), all_of(B))
    dim = rubber.mesh.geometry.dim
    F = np.eye(3)
    F[:dim, :dim] += np.array([[0.1, -0.2, 0.05], [0.3, -0.15, 0.1], [-0.1, 0.2, 0.05]])[:dim, :dim]
    expected = stress(F, B)[:dim, :dim]
    np.testing.assert_allclose(uniform(rubber, F[:dim, :dim]), expected, atol=1e-9 * B.C10)
    energy = energy_and_stress()[0](F.ravel(), B.C10, B.C01, B.D1) * SIZE**dim
    assert rubber.elastic_energy() == pytest.approx(energy)


@pytest.mark.parametrize("stretch", [0.7, 0.95, 1.5])
def test_uniaxial_stress_is_the_closed_form(stretch):
    def gradient(across):
        return np.diag([across, across, stretch])

    rubber = HyperelasticBody(a_block("hexahedron", 3), all_of(STIFF))
    across = brentq(lambda a: stress(gradient(a), STIFF)[0, 0], 0.5, 2.0, xtol=1e-15)
    P = uniform(rubber, gradient(across))
    assert abs(P[0, 0]) < 1e-4 * B.C10
    exact = reference.uniaxial_stress(stretch, B.C10, B.C01)
    assert P[2, 2] * stretch == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("stretch", [0.7, 1.5])
def test_plane_strain_stress_is_the_closed_form(stretch):
    def gradient(across):
        return np.diag([across, 1.0, stretch])

    rubber = HyperelasticBody(a_block("quadrilateral", 2), all_of(STIFF))
    across = brentq(lambda a: stress(gradient(a), STIFF)[0, 0], 0.5, 2.0, xtol=1e-15)
    P = uniform(rubber, np.diag([across, stretch]))
    assert abs(P[0, 0]) < 1e-4 * B.C10
    exact = 2.0 * (B.C10 + B.C01) * (stretch**2 - stretch**-2)  # incompressible Mooney-Rivlin
    assert P[1, 1] * stretch == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("cells", CELLS)
def test_tangent_is_the_derivative_of_the_forces(cells):
    rubber = HyperelasticBody(a_block(cells, 3), all_of(B))
    bend(rubber, 0.05)
    u = rubber.u.x.array
    start, step = u.copy(), 1e-5
    change, predicted = rubber.create_vector(), rubber.create_vector()
    with change.localForm() as local:
        local.array[:] = 0.1 * np.cos(3e3 * u + 0.2) * SIZE
        moves = local.array.copy()
    matrix = rubber.create_matrix()
    rubber.tangent(matrix)
    matrix.mult(change, predicted)
    sides = []
    for side in (1, -1):
        u[:] = start + side * step * moves
        forces = rubber.create_vector()
        rubber.internal_forces(forces)
        compat.sum_ghosts(forces)
        sides.append(forces)
    ahead, behind = sides
    ahead.axpy(-1.0, behind)
    ahead.scale(0.5 / step)
    ahead.axpy(-1.0, predicted)
    assert ahead.norm() < 1e-6 * predicted.norm()
    transposed = rubber.create_vector()
    matrix.multTranspose(change, transposed)
    transposed.axpy(-1.0, predicted)
    assert transposed.norm() < 1e-12 * predicted.norm()


@pytest.mark.parametrize("cells", ["quadrilateral", "hexahedron"])
def test_cells_of_the_upper_half_keep_their_volume_on_average(cells):
    """The others do at every point; on any number of ranks."""
    rubber = HyperelasticBody(a_block(cells, 4), all_of(B))
    dim, comm = rubber.mesh.geometry.dim, rubber.mesh.comm
    own = [np.count_nonzero(rubber.kinds == kind) for kind in (WHOLE, SPLIT)]
    assert [comm.allreduce(number) for number in own] == [4**dim / 2, 4**dim / 2]
    # displaced along z alone by a (1 - x^2) (1 - y^2) (1 - z^2) over the half size h of a cell:
    # J - 1 is the derivative by z, whose square the rules take over x and y as 16/15 h and 8/9 h
    X = rubber.space.tabulate_dof_coordinates()[:, :dim] / SIZE
    energies = []
    for z in (0.375, 0.625):  # in the middle of a cell below half the height, and of one above
        bubble = np.prod(np.clip(1.0 - (8.0 * (X - [*[0.375] * (dim - 1), z])) ** 2, 0.0, None), 1)
        rubber.displacements[:] = 0.0
        rubber.displacements[:, -1] = 0.01 * SIZE * bubble
        energies.append(rubber.elastic_energy())
    a, h = 0.01 * SIZE, SIZE / 8.0
    across = (16.0 / 15.0 * h) ** (dim - 1) - (8.0 / 9.0 * h) ** (dim - 1)
    velocity_error = a**2 / B.D1 * 8.0 / (3.0 * h) * across
    assert energies[0] - energies[1] == pytest.approx(velocity_error, rel=1e-9)


def test_tetrahedra_of_the_upper_half_keep_their_volume_at_one_point():
    """On any number of ranks."""
    block = a_block("tetrahedron", 4)
    rubber = HyperelasticBody(block, all_of(B))
    touching, _ = compat.facet_cell_pairs(block.mesh, rubber.facets("contact"))
    middles = compat.cell_midpoints(block.mesh)[: len(rubber.kinds), 2]
    split = middles > 0.5 * SIZE
    split[touching] = False
    np.testing.assert_array_equal(rubber.kinds == SPLIT, split)
    # displaced along z by a z^2: J - 1 = 2 a z, of which one point takes the mean of a cell
    a, z = 0.1 / SIZE, rubber.space.tabulate_dof_coordinates()[:, 2]
    rubber.displacements[:, 2] = a * z**2
    change = ufl.det(ufl.Identity(3) + ufl.grad(rubber.u)) - 1.0
    rule = {"quadrature_degree": WHOLE_DEGREE["tetrahedron"]}
    whole = energy_density(ufl.grad(rubber.u), B) * rubber.dx(metadata=rule)
    split_volume = change**2 / B.D1 * rubber.dx(SPLIT, metadata=rule)
    comm = block.mesh.comm
    exact, locked = (
        compat.assemble_scalar(compat.form(one), comm) for one in (whole, split_volume)
    )
    own = ((2.0 * a * middles[split]) ** 2).sum() * SIZE**3 / (6 * 4**3) / B.D1
    once = comm.allreduce(own)
    assert rubber.elastic_energy() - exact == pytest.approx(once - locked, rel=1e-6)
    assert once < locked


def test_inverted_elements_give_no_finite_forces():
    rubber = HyperelasticBody(a_block("quadrilateral", 2), all_of(B))
    assert not np.isfinite(uniform(rubber, np.diag([1.0, -0.5]))).all()


# --- a manufactured solution


def exact_displacement(x):
    a = [x[i] / SIZE for i in range(x.ufl_shape[0])]
    waves = [ufl.sin(2.0 * a[i] + 1.5 * a[i - 1] + 0.3 * i) for i in range(len(a))]
    return ufl.as_vector([0.05 * SIZE * wave for wave in waves])


def observed_orders(cells, numbers, material):
    """Orders of the L2 and H1 errors between meshes of `numbers` cells, each twice the last."""
    found = np.array([errors(cells, n, material) for n in numbers])
    return np.log2(found[:-1] / found[1:])


def errors(cells, n, material):
    """L2 error (m) and H1 error of the displacement, all boundaries held at the exact one."""
    rubber = HyperelasticBody(a_block(cells, n), all_of(material))
    mesh, dim = rubber.mesh, rubber.mesh.geometry.dim
    exact = exact_displacement(ufl.SpatialCoordinate(mesh))
    gradient = ufl.variable(ufl.grad(exact))
    body_force = -ufl.div(ufl.diff(energy_density(gradient, material), gradient))
    dx = ufl.dx(mesh, metadata={"quadrature_degree": 6})
    load = compat.form(ufl.dot(body_force, ufl.TestFunction(rubber.space)) * dx)
    external = compat.assemble_vector(rubber.create_vector(), load)

    rubber.u.interpolate(compat.expression(exact, rubber.space))
    interior = rubber.u.x.array.copy()
    outside = dolfinx_mesh.locate_entities_boundary(mesh, dim - 1, lambda x: x[0] < 2)
    boundary = fem.locate_dofs_topological(rubber.space, dim - 1, outside)
    rubber.displacements[:] *= 0.995  # so that Newton has something to do
    rubber.displacements[boundary] = interior.reshape(-1, dim)[boundary]

    index_map = rubber.space.dofmap.index_map
    owned = boundary[boundary < index_map.size_local]
    held = (owned[:, None] * dim + np.arange(dim)).ravel().astype(np.int32)
    residual, change, matrix = (
        rubber.create_vector(),
        rubber.create_vector(),
        rubber.create_matrix(),
    )
    solver = PETSc.KSP().create(mesh.comm)
    solver.setType("preonly")
    solver.getPC().setType("lu")
    solver.getPC().setFactorSolverType("mumps")
    for _ in range(8):
        rubber.internal_forces(residual)
        compat.sum_ghosts(residual)
        residual.axpy(-1.0, external)
        residual.array[held] = 0.0
        if residual.norm() < 1e-11 * external.norm():
            break
        rubber.tangent(matrix)
        matrix.zeroRowsColumns(held + index_map.local_range[0] * dim, diag=1.0)
        solver.setOperators(matrix)
        solver.solve(residual, change)
        compat.update_ghosts(change)
        with change.localForm() as local:
            rubber.u.x.array[:] -= local.array
    else:
        pytest.fail("Newton did not converge")
    wrong = rubber.u - exact
    squares = [ufl.dot(wrong, wrong) * dx, ufl.inner(ufl.grad(wrong), ufl.grad(wrong)) * dx]
    return [np.sqrt(compat.assemble_scalar(compat.form(square), mesh.comm)) for square in squares]


@pytest.mark.parametrize(
    "cells, numbers", [("quadrilateral", (4, 8, 16)), ("hexahedron", (2, 4, 8))]
)
def test_displacement_converges_to_a_manufactured_solution(cells, numbers):
    material = MooneyRivlin.from_nu(B.C10, B.C01, 0.3)
    orders = observed_orders(cells, numbers, material)
    np.testing.assert_allclose(orders[-1], [3.0, 2.0], atol=0.1)


def test_displacement_converges_for_the_nearly_incompressible_compound():
    # from above: K/G = 50 hardly locks the quadratic element, and finer meshes unlock it
    orders = observed_orders("quadrilateral", (16, 32, 64), B)
    assert (orders[-1] > [2.95, 1.95]).all()
    assert (orders[-1] < orders[0]).all()
