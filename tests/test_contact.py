"""Contact pressure and tractions: assembly against UFL, tangents against differences."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import ufl  # noqa: E402
from blocks import CELLS, SIZE, a_block, all_of, bend  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.laws.film import FilmLaw  # noqa: E402
from iceslide_fem.mechanics.contact import (  # noqa: E402
    Traction,
    blend,
    contact_forces,
    contact_state,
    contact_tangent,
    normal_pressure,
    sliding_friction,
    static_friction,
)
from iceslide_fem.mechanics.contact_surface import contact_surface  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS, CONTACT_TABLES, WATER_VISCOSITY  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.mpi, pytest.mark.quick, pytest.mark.versions]

DEGREE = 4
PENALTY = 2e9  # Pa/m
MU, LENGTH = 0.3, 2e-5
FILM = FilmLaw(CONTACT_TABLES["B"], nominal=None, ramp_pressure=6e4)


@pytest.fixture(params=CELLS)
def bent(request):
    """A block deformed smoothly, partly through the ice, and its contact surface."""
    rubber = HyperelasticBody(a_block(request.param), all_of(COMPOUNDS["B"]))
    bend(rubber)
    surface = contact_surface(rubber.space, rubber.facets("contact"), DEGREE)
    state = contact_state(surface, rubber.displacements, PENALTY)
    touching = surface.total(state.pressure > 0.0, state.area)
    assert 0.1 < touching / surface.total(1.0, state.area) < 0.9
    return rubber, surface


def static(pressure, displacement):
    return static_friction(pressure, displacement, MU, LENGTH)


def film_shear(pressure, displacement):
    shear, slope = FILM.shear(pressure, 3.0, 60e-9)
    return sliding_friction(shear, slope, displacement.shape[-1])


def both(pressure, displacement):
    return blend(static(pressure, displacement), film_shear(pressure, displacement), 0.4)


def state_and_traction(law, surface, u):
    state = contact_state(surface, u, PENALTY)
    return state, law(state.pressure, surface.displacements(u)[..., :-1])


def assembled_by_ufl(rubber, friction):
    """The same forces from a UFL form: area by Nanson's formula, traction from p and u."""
    u, dim = rubber.u, rubber.mesh.geometry.dim
    mesh = rubber.mesh
    F = ufl.Identity(dim) + ufl.grad(u)
    turned = ufl.det(F) * ufl.inv(F).T * ufl.FacetNormal(mesh)
    area = ufl.max_value(-turned[dim - 1], 0.0)
    pressure = PENALTY * ufl.max_value(-(ufl.SpatialCoordinate(mesh)[dim - 1] + u[dim - 1]), 0.0)
    stress = friction(pressure, [u[i] for i in range(dim - 1)])
    ds = ufl.Measure(
        "ds",
        mesh,
        subdomain_data=rubber.block.facet_tags,
        subdomain_id=rubber.block.tags["contact"],
        metadata={"quadrature_degree": DEGREE},
    )
    work = ufl.dot(ufl.as_vector([*stress, pressure]), ufl.TestFunction(rubber.space))
    return compat.assemble_vector(rubber.create_vector(), compat.form(work * area * ds))


def ufl_coulomb(pressure, u):
    size = ufl.sqrt(sum(component**2 for component in u) + LENGTH**2)
    return [-MU * pressure * component / size for component in u]


def ufl_ramped(pressure, u):
    shear = 5e4 * ufl.min_value(pressure / 6e4, 1.0)
    return [-shear, *(0.0 * component for component in u[1:])]


def ramped(pressure, displacement):
    x = pressure / 6e4
    slope = np.where((x > 0) & (x < 1), 5e4 / 6e4, 0.0)
    return sliding_friction(5e4 * np.clip(x, 0, 1), slope, displacement.shape[-1])


@pytest.mark.parametrize("law, friction", [(static, ufl_coulomb), (ramped, ufl_ramped)])
def test_assembly_equals_ufl(bent, law, friction):
    rubber, surface = bent
    u = rubber.displacements
    forces = contact_forces(surface, *state_and_traction(law, surface, u))
    own = rubber.create_vector()
    with own.localForm() as local:
        surface.scatter(forces, local.array.reshape(u.shape))
    compat.sum_ghosts(own)
    reference = assembled_by_ufl(rubber, friction)
    size = reference.norm()
    assert size > 0.0
    own.axpy(-1.0, reference)
    assert own.norm() < 1e-13 * size


@pytest.mark.parametrize("law", [static, film_shear, both])
def test_tangent_is_the_derivative_of_the_forces(bent, law):
    rubber, surface = bent
    u = rubber.displacements.copy()
    change = 0.1 * np.cos(3e3 * u + 0.2) * SIZE
    tangent = contact_tangent(surface, u, PENALTY, *state_and_traction(law, surface, u))
    predicted = np.einsum("faibj,fbj->fai", tangent, change[surface.dofs])
    step = 1e-6

    def forces(side):
        there = u + side * step * change
        return contact_forces(surface, *state_and_traction(law, surface, there))

    scale = abs(predicted).max(initial=0.0)
    difference = (forces(1) - forces(-1)) / (2 * step)
    np.testing.assert_allclose(difference, predicted, atol=1e-6 * scale)


def test_pressure_of_a_given_penetration(bent):
    rubber, surface = bent
    rubber.u.x.array[:] = 0.0
    rubber.displacements[:, -1] = -1e-6
    state = contact_state(surface, rubber.displacements, PENALTY)
    force = surface.total(state.pressure, state.area)
    assert force == pytest.approx(PENALTY * 1e-6 * SIZE ** (rubber.mesh.geometry.dim - 1))
    rubber.displacements[:, -1] = 1e-6
    state = contact_state(surface, rubber.displacements, PENALTY)
    assert not state.pressure.any()


def test_no_tension():
    gap = np.array([-2e-6, -0.0, 3e-6])
    np.testing.assert_array_equal(normal_pressure(gap, 1e9), [2e3, 0.0, 0.0])


def test_static_friction_is_coulomb_far_from_rest_and_stays_below_it():
    pressure, far = np.full((1, 3), 1e5), np.array([[[1e-3, 0.0], [0.0, -1e-3], [1e-6, 1e-6]]])
    value = static_friction(pressure, far, 0.1, 1e-6).value
    np.testing.assert_allclose(value[0, :2], [[-1e4, 0.0], [0.0, 1e4]], atol=1.0)
    assert (np.linalg.norm(value, axis=-1) < 1e4).all()


def test_film_shear_is_that_of_the_law_above_the_ramp_and_fades_below():
    pressure = np.array([0.0, 3e4, 6e4, 2e5])
    shear, _ = FILM.shear(pressure, 3.0, 70e-9)
    k = CONTACT_TABLES["B"](pressure).k
    full = k * WATER_VISCOSITY * 3.0 / 70e-9
    np.testing.assert_allclose(shear, full * [0.0, 0.5, 1.0, 1.0])
    assert not FILM.loads(np.zeros(3), np.full(3, 3.0)).squeeze_rate.any()


def test_nominal_pressure_for_the_film_law():
    film = FilmLaw(CONTACT_TABLES["B"], nominal=1e5, ramp_pressure=1e3)
    shear, slope = film.shear(np.array([2e3, 5e5]), 3.0, 70e-9)
    np.testing.assert_allclose(shear, 0.266 * WATER_VISCOSITY * 3.0 / 70e-9)
    np.testing.assert_array_equal(slope, 0.0)


def test_blend():
    one = Traction(np.ones(2), np.ones(2), np.ones(2))
    other = Traction(*(3 * part for part in one))
    for part in blend(one, other, 0.25):
        np.testing.assert_allclose(part, 1.5)
