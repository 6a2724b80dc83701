"""Heat in the rubber: the film between two bodies, half-spaces in contact, orders, conservation."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from test_heat import given_flux

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import Surface, implicit_stage
from iceslide_fem.film.loads import FilmLoads, FilmOnIce
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.point_conditions import Loading
from iceslide_fem.film.rubber_heat import FilmBetween, HalfFilm, RubberColumns, RubberSurface
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.reference import constant_flux_rise
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.scene.contact_table import ConstantContact
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.materials import (
    ICE_EFFUSIVITY,
    MELTING_TEMPERATURE,
    WATER_CONDUCTIVITY,
    rubber_solid,
)

DURATION, DENSITY = 7e-3, 940.0
T_0 = MELTING_TEMPERATURE - 4.0
RUBBER = rubber_solid(DENSITY)
RUBBER_EFFUSIVITY = RUBBER.effusivity
RUBBER_SHARE = RUBBER_EFFUSIVITY / (RUBBER_EFFUSIVITY + ICE_EFFUSIVITY)


def thesis_conditions(duration=DURATION):
    return Conditions.of(
        pressure=1e5,
        speed=3.0,
        temperature=T_0,
        k=0.266,
        D=29e-6,
        H_V=2.86e-6,
        initial_height=70e-9,
        duration=duration,
    )


def rubbed(q, rubber, steps=300, initial_height=70e-9):
    """Steps, growing with time, of ice and rubber below a film of constant height."""
    ice = Column(T_0, DURATION)
    state = InterfaceState(
        np.full(1, np.log(initial_height)), np.zeros(1), ice.initial(1), rubber.initial(1)
    )
    method = INTEGRATORS["sdirk2"]._replace(stage=given_flux(q))
    load = thesis_conditions().loads()
    taken = np.zeros(2)
    for dt in np.diff(DURATION * np.linspace(0.0, 1.0, steps + 1) ** 2):
        step = advance(state, load, load, dt, ice, method, rubber)
        state = step.state
        taken += step.ice_heat[0], step.rubber_heat[0]
    return ice, state, taken


def test_effusivity_of_the_data():
    assert pytest.approx(0.195, abs=5e-4) == RUBBER_SHARE


def test_heat_split_between_two_half_spaces_at_equal_surface_temperature():
    q, rubber = 5e4, RubberColumns(T_0, DURATION, RUBBER)
    ice, state, taken = rubbed(q, rubber)
    assert taken.sum() == pytest.approx(q * DURATION, rel=1e-12)
    assert taken[1] / taken.sum() == pytest.approx(RUBBER_SHARE, rel=0.01)
    rise = constant_flux_rise(q * (1.0 - RUBBER_SHARE), DURATION)
    assert ice.surface_temperature(state.ice) - T_0 == pytest.approx(rise, rel=2e-3)
    assert rubber.surface_temperature(state.rubber) - T_0 == pytest.approx(rise, rel=2e-3)
    # What was taken is there.
    assert rubber.column.heat(state.rubber) == pytest.approx(taken[1], rel=1e-12)
    assert ice.heat(state.ice) == pytest.approx(taken[0], rel=1e-12)


def test_warm_rubber_on_cold_ice_meets_at_the_contact_temperature():
    """T = (e_i T_i + e_r T_r) / (e_i + e_r) of two half-spaces brought together."""
    warm = RubberColumns(T_0 + 3.0, DURATION, RUBBER)
    ice, state, taken = rubbed(0.0, warm, initial_height=1e-9)
    expected = T_0 + RUBBER_SHARE * 3.0
    assert ice.surface_temperature(state.ice) == pytest.approx(expected, abs=3e-3)
    assert warm.surface_temperature(state.rubber) == pytest.approx(expected, abs=3e-3)
    assert taken.sum() == pytest.approx(0.0, abs=1e-9 * abs(taken[0]))
    exact = 2.0 * ICE_EFFUSIVITY * RUBBER_SHARE * 3.0 * np.sqrt(DURATION / np.pi)
    assert taken[0] == pytest.approx(exact, rel=0.01)


def test_an_insulating_contact_leaves_the_rubber_cold():
    ice, state, taken = rubbed(0.0, RubberColumns(T_0 + 3.0, DURATION, RUBBER, HalfFilm(10.0)))
    assert abs(taken[1]) <= 0.5 * 10.0 * 3.0 * DURATION * (1 + 1e-9)


def some_bodies(n=400):
    rng = np.random.default_rng(3)
    ice = Surface(T_0 + rng.uniform(3.6, 4.0, n), rng.uniform(1e-9, 1e-5, n), np.zeros(n))
    rubber = RubberSurface(
        T_0 + rng.uniform(3.6, 4.0, n),
        rng.uniform(1e-9, 4e-5, n),
        np.ones(n),
    )
    y, loads = np.log(rng.uniform(30e-9, 300e-9, n)), thesis_conditions().loads()
    loads = FilmLoads(*(np.full(n, part[0]) for part in loads[:4]))

    film = FilmOnIce(implicit_stage, y, np.zeros(n), 1e-5, loads)
    return ice, FilmBetween(film, rubber), y


def test_the_closed_form_of_the_film_between_two_bodies():
    """T_f = min(T_m, (q_f + G T_i + G T_r) / (2 G)), fluxes G (T_f - T), and what melts."""
    ice, film, y = some_bodies()
    stage = film.solve(ice)
    G = 2.0 * WATER_CONDUCTIVITY / np.exp(stage.log_height)
    on_ice = ice.offset + ice.resistance * stage.ice_flux
    rubber = film.rubber
    on_rubber = rubber.offset + rubber.resistance * stage.rubber_flux
    free = (stage.friction_power + G * on_ice + G * on_rubber) / (2.0 * G)
    T_f = np.minimum(MELTING_TEMPERATURE, free)
    np.testing.assert_allclose(stage.ice_flux, G * (T_f - on_ice), rtol=1e-5, atol=5.0)
    np.testing.assert_allclose(stage.rubber_flux, G * (T_f - on_rubber), rtol=1e-5, atol=5.0)
    rest = stage.friction_power - stage.ice_flux - stage.rubber_flux
    np.testing.assert_allclose(stage.melt_power, rest, atol=1e-4)
    assert (stage.melt_power >= 0.0).all() and 0.1 < stage.melting.mean() < 0.9
    np.testing.assert_array_equal(stage.melting, stage.melt_power > 0.0)


def test_the_slope_of_the_flux_is_its_derivative():
    ice, film, y = some_bodies()
    flux = film.solve(ice)
    warmer = ice._replace(offset=ice.offset + 1e-4)
    after = film.solve(warmer)
    slope = ice.resistance * (flux.ice_flux - after.ice_flux) / 1e-4
    same = flux.melting == after.melting
    np.testing.assert_allclose(slope[same], flux.ice_slope[same], atol=0.02)


def test_the_first_guess_of_the_film_height_does_not_matter():
    ice, film, y = some_bodies()
    stages = [film.solve(ice, guess) for guess in (y, y + np.log(10.0), y - 2.0)]
    for stage in stages[1:]:
        np.testing.assert_allclose(stage.log_height, stages[0].log_height, atol=1e-7)


def test_no_contact_no_heat_for_the_rubber():
    ice, film, y = some_bodies()
    rubber = film.rubber._replace(cover=np.zeros(y.size))
    bare = film._replace(rubber=rubber).solve(ice)
    assert np.abs(bare.rubber_flux).max() == 0.0


@pytest.mark.parametrize(("method", "order"), [("implicit-euler", 1), ("sdirk2", 2), ("sdirk3", 3)])
@pytest.mark.parametrize("start", [1e-3, 5e-3])
def test_the_coupled_law_has_the_order_of_its_integrator(method, order, start):
    """Half a millisecond of halved steps before melting begins (4.3 ms) and after it."""
    rubber, ice = RubberColumns(T_0, DURATION, RUBBER), Column(T_0, DURATION)
    loads = thesis_conditions().loads()
    state = InterfaceState(
        np.full(1, np.log(70e-9)), np.zeros(1), ice.initial(1), rubber.initial(1)
    )
    for _ in range(300):
        state = advance(state, loads, loads, start / 300, ice, INTEGRATORS["sdirk3"], rubber).state

    def end(steps):
        now = state
        for _ in range(steps):
            now = advance(now, loads, loads, 5e-4 / steps, ice, INTEGRATORS[method], rubber).state
        return float(now.log_height[0])

    exact = end(256) if order > 1 else end(1024)
    coarse = 2 if order == 3 else 8  # errors well above those of the stages' Newton iterations
    errors = [abs(end(steps) - exact) for steps in (coarse, 2 * coarse, 4 * coarse)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (slopes > order - 0.3).all(), (errors, slopes)


def test_heat_in_the_rubber_delays_melting_by_its_share():
    """The same temperature needs the effusivity of both: onset at 4.27 instead of 3.30 ms."""
    alone = simulate(thesis_conditions())
    both = simulate(thesis_conditions(), rubber=RubberColumns(T_0, DURATION, rubber_solid(1100.0)))
    assert alone.melt_onset[0] == pytest.approx(3.297e-3, rel=2e-3)
    assert both.melt_onset[0] == pytest.approx(4.27e-3, rel=2e-3)
    assert both.mu_peak[0] > alone.mu_peak[0]


def slid_at(speeds, conductance, colder=0.0, **changes):
    """The point at a speed (m/s) that goes from one to the other, under rubber so much colder."""
    here, contact = thesis_conditions(), ConstantContact(0.266, 29e-6, 2.86e-6)
    speed = Course(Curve((0.0, DURATION), speeds), DURATION)
    loading = Loading(Course(Curve.of(1e5), DURATION), speed, contact)
    here = here._replace(**{name: np.array([value]) for name, value in changes.items()})
    half_film = HalfFilm(conductance)
    rubber = RubberColumns(here.temperature - colder, DURATION, rubber_solid(1100.0), half_film)
    return simulate(here, tolerance=1e-2, rubber=rubber, loading=loading)


def test_the_onset_is_found_where_speed_rises_and_the_film_resists_heat():
    """Up to 5,000 steps were refused: the film's warmth was that of the speed before the step."""
    result = slid_at((0.3, 6.0), conductance=1e4)
    assert np.isfinite(result.melt_onset[0])
    assert result.rejected[0] <= 5


def test_a_film_far_below_the_ice_s_temperature_does_not_melt():
    """It was said to where it came as far below T_0 as T_m is above."""
    barely = MELTING_TEMPERATURE - 0.5
    result = slid_at((0.6, 0.05), conductance=1200.0, colder=3.0, temperature=barely)
    assert np.isnan(result.melt_onset[0])


def test_cuts_back_to_an_event_are_few():
    """Barely cold ice below rubber 3 K colder: straight lines alone took 292 cuts."""
    here = Conditions.of(
        pressure=8e4,
        speed=16.2,
        temperature=MELTING_TEMPERATURE - 0.13,
        k=0.0576,
        D=26.7e-6,
        H_V=0.723e-6,
        initial_height=12.9e-9,
        duration=4.264e-3,
    )
    rubber = RubberColumns(here.temperature - 3.0, here.duration, rubber_solid(1100.0))
    result = simulate(here, integrator="sdirk3", rubber=rubber)
    assert np.isfinite(result.melt_onset[0])
    assert result.rejected[0] <= 60


def test_the_closed_form_knows_no_rubber():
    """Its flux was taken for that of conduction in both bodies."""
    with pytest.raises(ValueError, match="half-space.*allowed with heat in the rubber: column"):
        simulate(thesis_conditions(), "half-space", rubber=RubberColumns(T_0, DURATION, RUBBER))


def test_conditions_of_several_durations_are_independent():
    rubber = RubberColumns(T_0, DURATION, RUBBER)
    conditions = thesis_conditions(np.array([2e-3, 5e-3, 7e-3]))
    together = simulate(conditions, rubber=rubber)
    alone = simulate(thesis_conditions(np.array([5e-3])), rubber=rubber)
    assert together.mu_end[1] == pytest.approx(alone.mu_end[0], rel=2e-3)


def test_a_height_that_does_not_agree_with_its_conductance_is_no_height():
    ice, between, y = some_bodies()
    signs, restless = itertools.cycle([1.0, -1.0]), np.arange(y.size) % 2 == 0

    def solve(surface, near=None):
        stage = between.film.solve(surface, near)
        return stage._replace(log_height=stage.log_height + 1e-3 * next(signs) * restless)

    film = SimpleNamespace(log_height=y, height=between.film.height, solve=solve)
    found = np.isfinite(between._replace(film=film).solve(ice).log_height)
    np.testing.assert_array_equal(found, ~restless)
