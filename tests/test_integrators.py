"""One step of film and ice: consistency, observed orders, error estimates, conservation."""

import numpy as np
import pytest

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance, error_norms
from iceslide_fem.film.point import Conditions, PointResult, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import GROW, SAFETY, SHRINK, step_factor
from iceslide_fem.scene.materials import CONTACT_TABLES, MELTING_TEMPERATURE

IMPLICIT = ("sdirk2", "sdirk3", "implicit-euler")
DURATION = 5e-3


def conditions(pressure=5e5, speed=4.0, duration=DURATION, initial_height=70e-9) -> Conditions:
    k, D, H_V, _ = CONTACT_TABLES["B"](pressure)
    return Conditions.of(
        pressure=pressure,
        speed=speed,
        temperature=269.15,
        k=k,
        D=D,
        H_V=H_V,
        initial_height=initial_height,
        duration=duration,
    )


def start(here: Conditions, column: Column) -> InterfaceState:
    n = here.pressure.size
    return InterfaceState(np.log(here.initial_height), np.zeros(n), column.initial(n))


@pytest.mark.parametrize("name", INTEGRATORS)
def test_coefficients_are_consistent(name):
    method = INTEGRATORS[name]
    nodes, weights = np.array(method.nodes), np.array(method.weights)
    for power in range(method.order):
        assert weights @ nodes**power == pytest.approx(1.0 / (power + 1))
    assert nodes[-1] == pytest.approx(1.0)
    if method.estimate:
        companion = weights - np.array(method.estimate)
        for power in range(method.estimate_order - 1):
            assert companion @ nodes**power == pytest.approx(1.0 / (power + 1))


def halving(name: str, steps: int) -> np.ndarray:
    """mu while dry, melting and saturated, and the times of both events."""
    result: PointResult = simulate(
        conditions(),
        integrator=name,
        fixed_step=DURATION / steps,
        tolerance=1e-9,
        times=(0.7e-3, 4.3e-3, 5e-3),
    )
    return np.array([*result.samples[:, 0], result.melt_onset[0], result.saturation[0]])


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return halving("sdirk3", 12_800)


@pytest.mark.parametrize(
    "name, slopes", [("sdirk2", 1.9), ("sdirk3", 2.5), ("implicit-euler", 0.88)]
)
def test_order_holds_before_and_after_melt_onset_and_saturation(name, slopes, exact):
    errors = np.array([np.abs(halving(name, n) / exact - 1.0) for n in (100, 200, 400)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert (orders[-1] > slopes).all(), orders
    # mu alone, which is not subject to how closely a step ends on an event
    assert (orders[:, :3] > slopes).all(), orders


def test_explicit_euler_is_of_first_order(exact):
    errors = np.array([np.abs(halving("explicit-euler", n) / exact - 1.0) for n in (400, 800)])
    orders = np.log2(errors[0] / errors[1])
    np.testing.assert_allclose(orders, 1.0, atol=0.2)


@pytest.mark.parametrize("name, order", [("sdirk2", 2), ("sdirk3", 3)])
def test_error_estimate_falls_with_its_order_and_bounds_the_error(name, order):
    """Local error of ln h in a smooth phase (melting, after 2 ms of 5 bar and 4 m/s)."""
    here = conditions()
    column, loads, method = Column(here.temperature, DURATION), here.loads(), INTEGRATORS[name]
    state = start(here, column)
    for _ in range(4000):
        state = advance(state, loads, loads, 0.5e-6, column, INTEGRATORS["sdirk3"]).state
    estimates, errors = [], []
    for dt in (8e-5, 4e-5, 2e-5):
        step = advance(state, loads, loads, dt, column, method)
        fine = state
        for _ in range(32):
            fine = advance(fine, loads, loads, dt / 32, column, INTEGRATORS["sdirk3"]).state
        estimates.append(abs(step.error(lambda change: change.log_height)[0]))
        errors.append(abs(step.state.log_height[0] - fine.log_height[0]))
    slopes = np.log2(np.array(estimates[:-1]) / estimates[1:])
    assert slopes[-1] == pytest.approx(order, abs=0.35)
    ratio = np.array(estimates) / errors
    assert (ratio > 1.0).all() and (ratio < 200.0).all()


@pytest.mark.parametrize("name", IMPLICIT)
@pytest.mark.parametrize("dt", [1e-9, 1e-5, 1.0])
def test_every_step_is_positive_and_conserves_energy(name, dt):
    here = Conditions.together(
        [
            conditions(),
            conditions(1e5, 3.0),
            conditions(1e5, 30.0, initial_height=1e-9),
            conditions(5e5, 30.0, initial_height=1e-9),
        ]
    )
    column, loads = Column(here.temperature, DURATION), here.loads()
    state = start(here, column)
    for _ in range(5):
        step = advance(state, loads, loads, dt, column, INTEGRATORS[name])
        assert np.isfinite(step.state.log_height).all()
        assert (step.state.squeezed_height <= here.H_V).all()
        np.testing.assert_allclose(step.friction_work, step.ice_heat + step.latent_heat, rtol=1e-12)
        extrapolated_velocity = column.heat(step.state.ice) - column.heat(state.ice)
        # Stages of a step that is far too long are large and cancel.
        np.testing.assert_allclose(
            extrapolated_velocity, step.ice_heat, rtol=1e-6 if dt == 1.0 else 1e-10
        )
        temperature = column.surface_temperature(step.state.ice)
        assert (temperature <= MELTING_TEMPERATURE + 1e-8).all()
        assert (step.last.melt_power >= 0.0).all()
        melting = step.last.melting
        np.testing.assert_allclose(temperature[melting], MELTING_TEMPERATURE, atol=1e-8)
        assert (step.last.melt_power[~melting] == 0.0).all()
        state = step.state


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_trial_step_leaves_its_start_untouched(name):
    here = conditions()
    column, loads = Column(here.temperature, DURATION), here.loads()
    state = start(here, column)
    before = InterfaceState(*(part.copy() for part in state))
    trial = advance(state, loads, loads, 1e-5, column, INTEGRATORS[name])
    for kept, was in zip(state, before, strict=True):
        np.testing.assert_array_equal(kept, was)
    again = advance(state, loads, loads, 1e-5, column, INTEGRATORS[name])
    np.testing.assert_array_equal(trial.state.log_height, again.state.log_height)


def test_steps_of_several_sizes_at_once_are_those_taken_alone():
    here = conditions()
    both = Conditions.together([here, here])
    method, dt = INTEGRATORS["sdirk2"], np.array([1e-5, 1e-4])
    column = Column(269.15, DURATION)
    loads = both.loads()
    together = advance(start(both, column), loads, loads, dt, column, method)
    for i in range(2):
        load = here.loads()
        alone = advance(start(here, column), load, load, float(dt[i]), column, method)
        assert together.state.log_height[i] == pytest.approx(alone.state.log_height[0], rel=1e-12)


def test_a_step_that_is_not_finite_has_an_infinite_error():
    here = conditions(1e5, 3.0)
    column, loads = Column(here.temperature, DURATION), here.loads()
    state = start(here, column)
    method = INTEGRATORS["explicit-euler"]
    step = advance(state, loads, loads, 1.0, column, method)
    error = error_norms(step, column, here.H_V, np.array([4.0]))
    assert np.isinf(error).all()


def test_step_factor():
    np.testing.assert_allclose(
        step_factor(np.array([0.0, 1.0, 4.0, 1e9, np.inf, np.nan]), 2),
        [GROW, SAFETY, SAFETY / 2.0, SHRINK, SHRINK, SHRINK],
    )
