"""Columns and half-space: against closed forms, conservation, the jump to the closed-form flux."""

import numpy as np
import pytest
from scipy.optimize import brentq

from iceslide_fem import reference
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance, error_norms
from iceslide_fem.film.law import FilmStage, Surface
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.point import Conditions, Record, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.scene.materials import MELTING_ENTHALPY, MELTING_TEMPERATURE, WATER_VISCOSITY

pytestmark = pytest.mark.quick

DURATION = 7e-3
T_0 = np.array([MELTING_TEMPERATURE - 4.0])


def given_flux(q: float):
    """A stage of a film that gives `q` (W/m2) and melts where the ice does not take it."""

    def stage(y, squeezed, dt, loads, ice: Surface, **guess) -> FilmStage:
        power = np.full_like(y, q)
        flux = np.minimum(power, ice.melted_flux)
        dry = ice.offset + ice.resistance * power
        melting = power > ice.melted_flux
        slope, zero, rest = melting.astype(float), np.zeros_like(y), power - flux
        return FilmStage(y, squeezed, power, flux, rest, dry, melting, melting, zero, slope, zero)

    return stage


def heated(ice, q: float, times: np.ndarray):
    """Content after `times` of the film above, and the last step."""
    method = INTEGRATORS["sdirk2"]._replace(stage=given_flux(q))
    zero = np.zeros(1)
    state = InterfaceState(zero, zero, ice.initial(1))
    load = Conditions.of(
        pressure=1e5,
        speed=3.0,
        temperature=T_0,
        k=0.3,
        D=3e-5,
        H_V=1e-6,
        initial_height=1e-7,
        duration=DURATION,
    ).loads()
    ice_heat = 0.0
    for dt in np.diff(times, prepend=0.0):
        step = advance(state, load, load, dt, ice, method)
        state, ice_heat = step.state, ice_heat + step.ice_heat
    return state.ice, ice_heat, step


def graded(end: float, steps: int = 300) -> np.ndarray:
    return end * (np.arange(1, steps + 1) / steps) ** 2


@pytest.mark.parametrize("time", [0.1e-3, 1e-3, 7e-3])
def test_constant_flux(time):
    column = Column(T_0, DURATION)
    heat_state, ice_heat, _ = heated(column, 5e4, graded(time))
    rise = column.surface_temperature(heat_state) - T_0
    assert rise == pytest.approx(reference.constant_flux_rise(5e4, time), rel=1e-4)
    assert column.heat(heat_state) == pytest.approx(ice_heat, rel=1e-12)
    assert ice_heat == pytest.approx(5e4 * time, rel=1e-12)


@pytest.mark.parametrize("error, modes", [(1e-3, 11), (1e-5, 16), (0.0, 27)])
def test_a_condensed_column_warms_as_the_whole_one_and_conserves_heat(error, modes):
    column = Column(T_0, DURATION)
    fewer, times = column.condensed(error), graded(DURATION)[10:]
    assert fewer.rates.size <= modes and fewer.rates[0] == 0.0 and (fewer.rates[1:] > 0.0).all()
    whole, ice_heat, _ = heated(column, 5e4, times)
    heat_state, _, _ = heated(fewer, 5e4, times)
    rise, exact = (
        c.surface_temperature(x) - T_0 for c, x in ((fewer, heat_state), (column, whole))
    )
    assert rise == pytest.approx(exact, rel=2.0 * error + 1e-12)
    assert fewer.heat(heat_state) == pytest.approx(ice_heat, rel=1e-11)
    depth = fewer.at_depths(heat_state) - column.at_depths(whole)
    assert np.abs(depth).max() <= 10.0 * np.sqrt(error) * exact.max()


def test_flux_after_the_surface_has_reached_the_melting_temperature():
    q, column = 2e5, Column(T_0, DURATION)
    onset = brentq(lambda t: reference.constant_flux_rise(q, t) - 4.0, 1e-6, DURATION)
    before = onset * (np.arange(1, 401) / 400) ** 2
    after = onset + (3.0 * onset) * (np.arange(1, 401) / 400) ** 2
    _, _, step = heated(column, q, np.concatenate([before, after]))
    expected = reference.flux_after_onset(q, onset, 4.0 * onset)
    assert step.last.ice_flux == pytest.approx(expected, rel=1e-3)
    assert column.surface_temperature(step.state.ice) == pytest.approx(MELTING_TEMPERATURE)


def test_what_melts_at_a_fixed_surface():
    """The rest of the friction heat, over the latent heat; the surface does not recede."""
    q = 2.3e5
    onset = brentq(lambda t: reference.constant_flux_rise(q, t) - 4.0, 1e-6, 1e-1)
    times = np.concatenate([graded(onset), onset + graded(DURATION - onset)])
    _, in_ice, step = heated(Column(T_0, DURATION), q, times)
    assert step.last.melting.all()
    melted = (q * DURATION - in_ice) / MELTING_ENTHALPY
    assert melted == pytest.approx(reference.melted_depth(q, onset, DURATION), rel=2e-3)


def test_onset_below_a_film_that_is_squeezed_out():
    """Melt onset of the four reference cases from Duhamel's integral."""
    for pressure, speed, k, D in (
        (1e5, 3.0, 0.266, 29e-6),
        (1e5, 4.0, 0.266, 29e-6),
        (5e5, 3.0, 0.405, 46.5e-6),
        (5e5, 4.0, 0.405, 46.5e-6),
    ):
        K3 = float(reference.squeeze_coefficient(pressure, D))
        viscous = k * WATER_VISCOSITY * speed

        def lack(t, viscous=viscous, speed=speed, K3=K3):
            return float(reference.squeezing_rise(viscous, speed, 70e-9, K3, t)) - 4.0

        onset = brentq(lack, 1e-6, DURATION)
        result = simulate(
            Conditions.of(
                pressure=pressure,
                speed=speed,
                temperature=T_0,
                k=k,
                D=D,
                H_V=2.86e-6,
                initial_height=70e-9,
                duration=DURATION,
            ),
            tolerance=1e-5,
        )
        assert result.melt_onset == pytest.approx(onset, rel=4e-4)


def test_finer_columns_converge_to_the_half_space():
    errors = []
    for first, ratio in ((0.1, 3.0), (0.05, 2.2), (0.0125, 1.4)):
        column = Column(T_0, DURATION, first_layer=first, ratio=ratio, depth=6.0)
        heat_state, _, _ = heated(column, 5e4, graded(DURATION, 1000))
        rise = column.surface_temperature(heat_state) - T_0
        errors.append(abs(rise[0] / reference.constant_flux_rise(5e4, DURATION) - 1.0))
    assert errors[0] > 4 * errors[1] > 16 * errors[2]
    assert errors[2] < 2e-5


def test_columns_of_several_temperatures_are_independent():
    temperatures = np.array([263.15, 269.15, 272.15])
    conditions = Conditions.of(
        pressure=1e5,
        speed=4.0,
        temperature=temperatures,
        k=0.266,
        D=29e-6,
        H_V=2.86e-6,
        initial_height=70e-9,
        duration=DURATION,
    )
    together = simulate(conditions)
    alone = [simulate(conditions.take(np.array([i]))).mu_end[0] for i in range(3)]
    np.testing.assert_allclose(together.mu_end, alone, rtol=1e-9)


@pytest.mark.parametrize("model", [Column, HalfSpace])
def test_take_keeps_the_chosen_points(model):
    temperature = np.array([260.0, 265.0, 270.0])
    ice = model(temperature, DURATION)
    part = ice.take(np.array([2, 0]))
    np.testing.assert_array_equal(part.surface_temperature(part.initial(2)), [270.0, 260.0])


def test_half_space_draws_the_closed_form_flux_once_melting_has_begun():
    q, half_space = 2e5, HalfSpace(T_0, DURATION)
    heat_state, _, step = heated(half_space, q, graded(5e-3))
    assert step.last.melting.all()
    assert half_space.surface_temperature(heat_state) == pytest.approx(
        MELTING_TEMPERATURE, abs=1e-9
    )
    # The last stage ends the step, so its flux is that of the end.
    assert step.last.ice_flux == pytest.approx(reference.step_flux(T_0, 5e-3))


def test_half_space_conducts_until_melting_begins():
    heat_state, _, _ = heated(HalfSpace(T_0, DURATION), 5e4, graded(1e-3))
    conducting, _, _ = heated(Column(T_0, DURATION), 5e4, graded(1e-3))
    np.testing.assert_allclose(heat_state[:-1], conducting)


def test_an_onset_in_the_second_stage_is_no_error_of_the_half_space():
    """A switch from T to T_m there is no error of the temperature: the column's estimate holds."""
    q = 2e5
    onset = float(brentq(lambda t: reference.constant_flux_rise(q, t) - 4.0, 1e-6, DURATION))
    method, errors = INTEGRATORS["sdirk2"]._replace(stage=given_flux(q)), []
    load, zero = FilmLoads(*np.zeros((3, 1)), np.ones(1)), np.zeros(1)
    for ice in (Column(T_0, DURATION), HalfSpace(T_0, DURATION)):
        heat_state, *_ = heated(ice, q, graded(0.95 * onset))
        state = InterfaceState(zero, zero, heat_state)
        step = advance(state, load, load, 0.1 * onset, ice, method)
        assert step.last.melting.all()
        errors.append(error_norms(step, ice, load.free_height, np.full(1, 4.0)))
    assert errors[1] == pytest.approx(errors[0], rel=1e-6)


def test_closed_form_flux_is_about_half_of_the_true_one_right_after_onset():
    """The bias of the half-space option under constant friction power: 2 / pi, and less later."""
    q, onset = 1e5, float(brentq(lambda t: reference.constant_flux_rise(1e5, t) - 4.0, 1e-6, 1.0))
    ratio = reference.step_flux(T_0, onset) / reference.flux_after_onset(q, onset, onset)
    assert ratio == pytest.approx(2.0 / np.pi)


def test_content_is_the_integral_of_the_flux_through_all_phases():
    conditions = Conditions.of(
        pressure=5e5,
        speed=4.0,
        temperature=T_0,
        k=0.405,
        D=46.5e-6,
        H_V=0.56e-6,
        initial_height=70e-9,
        duration=5e-3,
    )
    ice_heat = 0.0

    def observe(record: Record) -> None:
        nonlocal ice_heat
        ice_heat += record.step.ice_heat[0]
        assert record.ice.heat(record.step.state.ice)[0] == pytest.approx(ice_heat, rel=1e-11)

    result = simulate(conditions, observe=observe)
    assert result.saturation[0] < 5e-3 and ice_heat > 0.0


def test_a_column_for_a_longer_run_goes_on_below():
    """Its first layers are those of the shorter one, and what that held goes on in them."""
    short, long = Column(T_0, DURATION), Column(T_0, [DURATION, 9.0 * DURATION])
    n = short.depths.size
    assert long.depths[-1] > 2.5 * short.depths[-1]
    np.testing.assert_allclose(long.depths[:n], short.depths, rtol=1e-12)
    heat_state, heat, _ = heated(short, 5e4, graded(DURATION))
    kept = long.restored(short.saved(heat_state))
    np.testing.assert_allclose(
        short.restored(short.saved(heat_state)), heat_state, rtol=1e-12, atol=1e-9
    )
    assert long.surface_temperature(kept) == pytest.approx(short.surface_temperature(heat_state))
    assert long.heat(kept) == pytest.approx(heat, rel=5e-4)
    closed = HalfSpace(T_0, DURATION)
    start = closed.initial(1) + 1.0
    np.testing.assert_allclose(closed.restored(closed.saved(start)), start, rtol=1e-9)
