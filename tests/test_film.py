"""The film law alone: closed forms, complementarity, conservation, robustness."""

import numpy as np
import pytest

from iceslide_fem import reference
from iceslide_fem.film import height
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import FilmStage, Surface, implicit_stage
from iceslide_fem.film.loads import FilmLoads, film_loads
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.scene.materials import MELTING_ENTHALPY, MELTING_TEMPERATURE, WATER_VISCOSITY

pytestmark = pytest.mark.quick

ONE_BAR = {"k": 0.266, "D": 29e-6, "H_V": 2.86e-6}
H0 = 70e-9


class UnchangingIce:
    """Ice that never changes: what the film sees is `ice`."""

    def __init__(self, offset: float, resistance: float, melted_flux: float) -> None:
        self.ice = Surface(*(np.array([x]) for x in (offset, resistance, melted_flux)))

    def stage(self, start, dt, film):
        return start, film.solve(self.ice)


COLD = UnchangingIce(MELTING_TEMPERATURE - 4.0, 0.0, 1e30)
ADIABATIC = UnchangingIce(MELTING_TEMPERATURE, 1.0, 0.0)


def loads(pressure: float = 1e5, speed: float = 3.0, **parameters: float) -> FilmLoads:
    values = {**ONE_BAR, **parameters}
    return film_loads(
        *(np.array([x]) for x in (pressure, speed, values["k"], values["D"], values["H_V"]))
    )


def heights(ice, load: FilmLoads, duration: float, steps: int, state=None, method="sdirk3"):
    """State after `steps` equal steps."""
    if state is None:
        state = InterfaceState(np.log([H0]), np.zeros(1), np.zeros((1, 1)))
    for _ in range(steps):
        state = advance(state, load, load, duration / steps, ice, INTEGRATORS[method]).state
    return state


def test_squeeze_only():
    state = heights(COLD, loads(), 5e-3, 200)
    h = np.exp(state.log_height)
    K3 = reference.squeeze_coefficient(1e5, 29e-6)
    assert h == pytest.approx(reference.squeezed_film(H0, K3, 5e-3), rel=1e-7)
    assert state.squeezed_height == pytest.approx(H0 - h, rel=1e-6)


def test_melt_only_without_conduction():
    state = heights(ADIABATIC, loads(pressure=0.0), 1e-3, 200)
    K1 = reference.melt_coefficient(0.266, 3.0)
    assert np.exp(state.log_height) == pytest.approx(reference.melting_film(H0, K1, 1e-3), rel=1e-6)
    assert state.squeezed_height == 0.0


def test_steady_balance_of_melting_and_squeeze_out():
    state = heights(ADIABATIC, loads(H_V=1.0), 1.0, 50)
    K1, K3 = reference.melt_coefficient(0.266, 3.0), reference.squeeze_coefficient(1e5, 29e-6)
    assert np.exp(state.log_height) == pytest.approx(reference.balanced_film(K1, K3), rel=1e-9)


def test_saturated_film_with_the_closed_form_flux():
    T_0, start, end = np.array([MELTING_TEMPERATURE - 4.0]), 1e-3, 7e-3
    K1 = reference.melt_coefficient(0.266, 3.0)
    ice = HalfSpace(T_0, end)
    heat_state = ice.initial(1)
    heat_state[-2:, 0] = 1.0, start  # melting since long, in contact since `start`
    state = InterfaceState(
        np.log(reference.saturated_film(K1, T_0, start)), np.array([2.86e-6]), heat_state
    )
    state = heights(ice, loads(), end - start, 200, state)
    assert np.exp(state.log_height) == pytest.approx(
        reference.saturated_film(K1, T_0, end), rel=1e-7
    )
    assert state.squeezed_height == 2.86e-6


def random_stages(seed: int = 0, n: int = 20_000) -> tuple[FilmStage, tuple]:
    """Stages from states, loads and ice of all magnitudes."""
    rng = np.random.default_rng(seed)

    def log_uniform(low, high):
        return 10.0 ** rng.uniform(low, high, n)

    h, dt = log_uniform(-9.0, -5.0), log_uniform(-9.0, 1.0)
    H_V = log_uniform(-7.0, -5.0)
    squeezed = H_V * rng.choice([0.0, 0.5, 1.0], n)
    load = film_loads(
        rng.choice([0.0, 1e5, 1e6], n),
        rng.choice([0.0, 0.1, 3.0, 30.0], n),
        rng.uniform(0.01, 1.0, n),
        log_uniform(-5.0, -4.0),
        H_V,
    )
    offset = MELTING_TEMPERATURE - rng.choice([0.0, 1e-6, 4.0, 40.0], n)
    resistance = log_uniform(-8.0, -3.0)
    ice = Surface(offset, resistance, (MELTING_TEMPERATURE - offset) / resistance)
    return implicit_stage(np.log(h), squeezed, dt, load, ice), (h, squeezed, dt, load, ice)


def test_a_stage_of_any_length_is_finite_positive_and_conserves_energy_and_water():
    stage, (h, squeezed, dt, load, ice) = random_stages()
    found = np.flatnonzero(np.isfinite(stage.log_height))
    assert found.size == h.size
    stage, load = type(stage)(*(x[found] for x in stage[:11])), load.take(found)
    ice = Surface(*(x[found] for x in ice[:3]))
    h, squeezed, dt = h[found], squeezed[found], dt[found]
    assert all(np.isfinite(part).all() for part in stage)
    assert (np.exp(stage.log_height) > 0.0).all()
    np.testing.assert_allclose(stage.friction_power, stage.ice_flux + stage.melt_power, rtol=1e-12)
    assert (stage.squeezed_height <= load.free_height * (1 + 1e-12)).all()
    # The stage's equations, in the relative precision of their largest term.
    y, new_h = stage.log_height, np.exp(stage.log_height)
    melting = dt * stage.melt_power / MELTING_ENTHALPY / new_h
    squeezing = (stage.squeezed_height - squeezed) / new_h
    size = 1.0 + np.abs(y - np.log(h)) + melting + squeezing
    gain = dt * stage.friction_power / MELTING_ENTHALPY / new_h
    residual = np.abs(y - np.log(h) - melting + squeezing) / (size + gain)
    assert np.quantile(residual, 0.999) <= 1e-11
    assert residual.max() <= 1e-7


def test_melting_is_complementary_to_being_colder_than_the_melting_temperature():
    stage, (*_, ice) = random_stages(1)
    temperature = ice.offset + ice.resistance * stage.ice_flux
    scale = 1e-9 * stage.friction_power
    assert (stage.melt_power >= -scale).all()
    assert (temperature <= MELTING_TEMPERATURE * (1 + 1e-12)).all()
    lack = np.maximum(MELTING_TEMPERATURE - temperature, 0.0)
    assert (np.minimum(lack / MELTING_TEMPERATURE, stage.melt_power) <= 1e-12).all()
    assert stage.melting.any() and not stage.melting.all()


def test_saturation_is_complementary_to_room():
    stage, (_, squeezed, dt, load, _) = random_stages(2)
    full = load.squeeze_rate * dt * np.exp(3 * stage.log_height)
    room = load.free_height - stage.squeezed_height
    np.testing.assert_allclose(room[stage.saturated], 0.0, atol=1e-12 * load.free_height.max())
    free = ~stage.saturated
    np.testing.assert_allclose(
        stage.squeezed_height[free], (squeezed + full)[free], rtol=1e-6, atol=1e-20
    )


def test_loads():
    load = loads()
    assert load.viscous == pytest.approx(0.266 * WATER_VISCOSITY * 3.0)
    assert load.squeeze_rate == pytest.approx(reference.squeeze_coefficient(1e5, 29e-6))
    assert loads(pressure=-1.0).squeeze_rate == 0.0
    middle = loads().at(loads(pressure=3e5), 0.5)
    assert middle.squeeze_rate == pytest.approx(loads(pressure=2e5).squeeze_rate)


def test_falling_free_height_does_not_return_squeezed_water():
    """H_V falls as pressure rises: H_s then stays, and the film is saturated."""
    state = InterfaceState(np.log([H0]), np.array([2e-6]), np.zeros((1, 1)))
    tight = loads(H_V=1e-6)
    step = advance(state, tight, tight, 1e-4, COLD, INTEGRATORS["sdirk2"])
    assert step.state.squeezed_height == 2e-6
    assert step.last.saturated.all()
    assert step.state.log_height == pytest.approx(state.log_height)


def test_heights_where_two_roots_are_about_to_merge():
    """Newton's method creeps past the place where two have been: these were not found."""
    start, *parts = np.array(
        [
            (-13.464018329904837, 7.03209599365409e17, 5.22839348625777e-07, 3.4e-16, 4.567e-07),
            (-15.285405163239625, 2522841316231611.5, 8.458769741056882e-08, 1.24e-18, 1.69e-08),
            (-13.420395043581875, 362993041922686.44, 5.461391828691998e-07, 2.2e-18, 0.0),
            (-11.8243231878187, 1487286590624.6572, 2.6942981040896645e-06, 6.0e-20, 4.86e-16),
        ]
    ).T
    equation = height.HeightEquation(start, *parts)
    y, inverse = height.log_height_of(equation)
    assert (np.abs(equation.residual(y)) <= 1e-12).all()
    np.testing.assert_allclose(inverse, np.exp(-y))


def test_the_derivatives_are_those_of_the_equation():
    rng = np.random.default_rng(5)
    y, n = np.log(rng.uniform(2e-8, 1e-6, 200)), 200
    rates = rng.uniform(0.0, 1e13, n), rng.uniform(0.0, 1e-7, n), rng.uniform(0.0, 1e-14, n)
    equation = height.HeightEquation(y + rng.uniform(-0.1, 0.1, n), *rates, rng.uniform(0, 1e-7, n))
    value, slope, curve = equation.derivatives(y, equation.terms(y))
    np.testing.assert_allclose(value, equation.residual(y), rtol=1e-9, atol=1e-12)
    before, after = (equation.residual(y + step) for step in (-1e-4, 1e-4))
    plain = slope > 0.1  # it is bounded from below
    smooth = plain & (
        np.diff([equation.terms(y + step).full for step in (-1e-4, 1e-4)], axis=0)[0] == 0
    )
    smooth &= np.diff([equation.terms(y + step).melts for step in (-1e-4, 1e-4)], axis=0)[0] == 0
    assert smooth.sum() > 100
    np.testing.assert_allclose(((after - before) / 2e-4)[smooth], slope[smooth], rtol=1e-5)
    second = (after - 2.0 * value + before) / 1e-8
    np.testing.assert_allclose(second[smooth], curve[smooth], rtol=1e-2, atol=1e-3)


def test_an_equation_that_is_none_has_no_height():
    one = np.ones(1)
    y, _ = height.log_height_of(height.HeightEquation(-16.0 * one, one, np.nan * one, one, one))
    assert np.isnan(y).all()


@pytest.mark.parametrize("close", [1e-4, 0.04])
def test_heights_are_found_near_a_guess_as_closely_as_is_asked(close):
    """Halley's method leaves the cube of its last change, from wherever it starts."""
    exact, (h, squeezed, dt, load, ice) = random_stages()
    near = exact.log_height + np.random.default_rng(4).uniform(-0.3, 0.3, h.size)
    found = implicit_stage(np.log(h), squeezed, dt, load, ice, near, close)
    error = np.abs(found.log_height - exact.log_height)
    assert np.quantile(error, 0.999) <= close**3
    np.testing.assert_allclose(found.friction_power, found.ice_flux + found.melt_power, rtol=1e-12)


def test_a_height_is_no_root_where_its_change_is_short_for_its_curvature():
    """A stage in which thousands of heights melt and are squeezed out: h stayed as it was."""
    start, h = np.log([1e-7]), 1e-7
    parts = (1e5 / h**2, 2.5e4 * h, 1.2e4 * h**2, 1e-2 * h)
    equation = height.HeightEquation(start, *(np.array([part]) for part in parts))
    y, _ = height.log_height_of(equation)
    residual, slope, _ = equation.derivatives(y, equation.terms(y))
    assert np.abs(residual) <= 1e-3 * slope
