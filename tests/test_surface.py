"""The contact surface's quadrature: points, areas and their derivatives."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from blocks import CELLS, SIZE, a_block, all_of, bend  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.contact_surface import contact_surface, space_degree  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.mpi, pytest.mark.quick, pytest.mark.versions]

WORLD = MPI.COMM_WORLD
DEGREE = 4


@pytest.fixture(params=CELLS)
def rubber(request):
    return HyperelasticBody(a_block(request.param), all_of(COMPOUNDS["B"]))


def deformed(rubber, mapping):
    """Nodal displacements of a mapping of positions (n, d) -> (n, d)."""
    dim = rubber.mesh.geometry.dim
    X = rubber.space.tabulate_dof_coordinates()[:, :dim]
    return mapping(X) - X


def test_undeformed_block_covers_its_bottom(rubber):
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    area = surface.footprint(np.zeros_like(rubber.displacements))
    assert surface.total(1.0, area) == pytest.approx(SIZE ** (rubber.mesh.geometry.dim - 1))
    points = surface.positions(np.zeros_like(rubber.displacements))
    # vertical sides cover nothing (to rounding, whose sign is of no importance)
    above = area[points[..., -1].min(axis=1, initial=1.0) > 0.01 * SIZE] if len(area) else area
    assert above.max(initial=0.0) < 1e-14 * SIZE
    assert WORLD.allreduce(surface.n_points) == WORLD.allreduce(area.size)


def test_polynomials_are_integrated_exactly(rubber):
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    motion_at_rest = np.zeros_like(rubber.displacements)
    area = surface.footprint(motion_at_rest)
    x = surface.positions(motion_at_rest)[..., 0] / SIZE
    face = SIZE ** (rubber.mesh.geometry.dim - 1)
    assert surface.total(x**4, area) == pytest.approx(face / 5)


def test_fewer_points_across_than_along_the_sliding_direction(rubber):
    facets, dim = rubber.facets("contact"), rubber.mesh.geometry.dim
    few = contact_surface(rubber.space, facets, DEGREE, across=1)
    motion_at_rest = np.zeros_like(rubber.displacements)
    x, y = np.moveaxis(few.positions(motion_at_rest)[..., :2] / SIZE, -1, 0)
    area, face = few.footprint(motion_at_rest), SIZE ** (dim - 1)
    assert few.total(x**4, area) == pytest.approx(face / 5)
    if compat.cell_name(rubber.mesh) == "hexahedron":
        even = contact_surface(rubber.space, facets, DEGREE)
        assert WORLD.allreduce(3 * few.n_points) == WORLD.allreduce(even.n_points)
        assert few.total(y, area) == pytest.approx(face / 2)
        assert few.total(y**2, area) < 0.999 * face / 3  # the middle of each facet's side alone


def test_rotated_block_covers_the_shadows_of_bottom_and_side(rubber):
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    angle, dim = 0.4, rubber.mesh.geometry.dim

    def rotated(X):
        x = X.copy()
        x[:, 0] = np.cos(angle) * X[:, 0] - np.sin(angle) * X[:, -1]
        x[:, -1] = np.sin(angle) * X[:, 0] + np.cos(angle) * X[:, -1]
        return x

    area = surface.footprint(deformed(rubber, rotated))
    exact = SIZE ** (dim - 1) * (np.cos(angle) + 0.5 * np.sin(angle))
    assert surface.total(1.0, area) == pytest.approx(exact)


def test_stretched_and_sheared_block(rubber):
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    dim = rubber.mesh.geometry.dim

    def pulled(X):
        x = X.copy()
        x[:, 0] = 1.2 * X[:, 0] + 40.0 * X[:, 0] ** 2 + 0.3 * X[:, 1]
        x[:, -1] = 0.7 * X[:, -1]
        return x

    exact = (1.2 + 40.0 * SIZE) * SIZE ** (dim - 1)
    area = surface.footprint(deformed(rubber, pulled))
    if dim == 2:  # one sheared side leans over the ice, up to half the height
        exact += 0.3 * 0.5 * SIZE
    assert surface.total(1.0, area) == pytest.approx(exact)


def test_derivative_of_the_area(rubber):
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    bend(rubber)
    u = rubber.displacements
    change = 0.1 * np.cos(3e3 * u + 0.2) * SIZE
    slope = np.einsum("fqkd,fqka->fqad", surface.footprint_slopes(u), surface.slopes)
    step = 1e-6
    ahead, behind = (surface.footprint(u + side * step * change) for side in (1, -1))
    predicted = np.einsum("fqad,fad->fq", slope, change[surface.dofs])
    scale = abs(predicted).max(initial=0.0)
    np.testing.assert_allclose((ahead - behind) / (2 * step), predicted, atol=1e-7 * scale)


def test_scatter_adds_shape_functions_up_to_the_area(rubber):
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    u = rubber.displacements
    area = surface.footprint(u)
    vector = rubber.create_vector()
    with vector.localForm() as local:
        nodal = np.einsum("fqa,fq->fa", surface.shape, area)
        forces = np.repeat(nodal[..., None], u.shape[1], axis=2)
        surface.scatter(forces, local.array.reshape(u.shape))
    compat.sum_ghosts(vector)
    assert vector.sum() == pytest.approx(u.shape[1] * surface.total(1.0, area))


def test_degree_of_a_space(rubber):
    assert space_degree(rubber.space) == 2
    assert space_degree(compat.vector_space(rubber.mesh, 1)) == 1
