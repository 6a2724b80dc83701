"""Friction heat and heat balance: units, closed forms, and the thesis's own numbers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from iceslide_fem import reference
from iceslide_fem.preprocess.footprint.jaeger import (
    TABLE_1_ICE,
    TABLE_1_RUBBER,
    Solid,
    friction_flux,
    jaeger_exposure,
    jaeger_rise,
    moving_source_rise,
    next_pixel_rise,
)
from iceslide_fem.preprocess.footprint.macroscopic import (
    Macroscopic,
    State,
    classify,
    friction_map,
    heat_balance,
)
from iceslide_fem.scene.materials import ICE_EFFUSIVITY, MELTING_TEMPERATURE

pytestmark = pytest.mark.quick

SLIDING, P_AV = Macroscopic(speed=3.0, slip=0.5), 2e5


def test_friction_flux_with_table_2_is_a_watt():
    assert friction_flux(0.1, 5e5, 3.0, 1e-5) == pytest.approx(1.5)


def test_jaegers_formula_is_an_instantaneous_point_source():
    """The heat rho c dT over all space is the heat released, at any time."""
    solid = Solid(conductivity=3.0, density=2.0, heat_capacity=5.0)
    for t in (0.1, 2.0):
        heat, _ = quad(
            lambda r, t=t: 4.0 * np.pi * r**2 * float(jaeger_rise(7.0, r, t, solid)), 0.0, 50.0
        )
        assert solid.density * solid.heat_capacity * heat == pytest.approx(7.0)


def test_printed_data_give_the_published_rise_only_after_about_a_second():
    """5 K of (4.1) from table 1 and 2: the contact lasts 0.06 s, the formula needs 1 to 2 s."""
    Q = float(friction_flux(0.1, 2e5, 3.0, 1e-5))
    assert jaeger_exposure(Q, 5.0, TABLE_1_ICE) == pytest.approx(1.0713, rel=1e-4)
    assert jaeger_rise(Q, 1e-4, 1.0, TABLE_1_ICE) == pytest.approx(5.533, rel=1e-3)
    assert jaeger_rise(Q, 1e-4, 0.06, TABLE_1_ICE) == pytest.approx(364.3, rel=1e-3)
    assert reference.band_source_rise(Q, 0.18, 3.0) < 1e-4


def test_exposure_inverts_the_rise():
    t = jaeger_exposure(0.6, 4.5, TABLE_1_ICE)
    assert jaeger_rise(0.6, 0.0, t, TABLE_1_ICE) == pytest.approx(4.5)


def test_the_next_pixel_towards_x_is_the_only_source():
    flux = np.array([[0.0, 0.0, 3.0, 0.0]])
    rise = next_pixel_rise(flux, 1e-3, 0.5, TABLE_1_ICE)
    assert rise[0, 1] == pytest.approx(float(jaeger_rise(3.0, 1e-3, 0.5, TABLE_1_ICE)))
    assert np.count_nonzero(rise) == 1


@pytest.mark.parametrize(("length", "v"), [(1e-3, 3.0), (20e-3, 4.0)])
def test_moving_source_against_the_band_source(length, v):
    pixels, q = 2000, 1e5
    flux = np.zeros((3, 3 * pixels))
    flux[:, pixels : 2 * pixels] = q
    rise = moving_source_rise(flux, length / pixels, v)
    assert rise[:, pixels] == pytest.approx(float(reference.band_source_rise(q, length, v)))
    assert rise.max() == rise[0, pixels]
    mean = rise[0, pixels : 2 * pixels].mean()
    assert mean == pytest.approx(2.0 / 3.0 * rise.max(), rel=1e-3)
    assert rise[:, 2 * pixels :] == pytest.approx(0.0, abs=1e-9)  # ahead of the band


def test_moving_source_numbers_of_the_closed_form():
    for length, v, expected in ((1e-3, 3.0, 0.963), (20e-3, 4.0, 3.730)):
        rise = moving_source_rise(np.full(100, 1e5), length / 100, v)
        assert rise[0] == pytest.approx(expected, abs=6e-4)


def test_moving_source_of_a_varying_flux_is_duhamels_integral():
    rng = np.random.default_rng(3)
    flux, dx, V = rng.uniform(0.0, 2e5, 50), 3e-4, 3.0
    rise = moving_source_rise(flux, dx, V)
    ends = np.arange(51) * dx / V
    q = flux[::-1]
    for n in (1, 10, 50):
        ages = np.sqrt(ends[n] - ends[: n + 1])
        expected = 2.0 / (ICE_EFFUSIVITY * np.sqrt(np.pi)) * (q[:n] * (ages[:-1] - ages[1:])).sum()
        assert rise[50 - n] == pytest.approx(expected)


def test_states_at_their_bounds():
    temperature = np.array([-4.0, -2.001, -2.0, -0.001, 0.0, 1.0, 5.0])
    contact = np.array([True] * 6 + [False])
    dry, mixed, wet = State.DRY, State.MIXED, State.WET
    assert classify(temperature, contact).tolist() == [dry, dry, mixed, mixed, wet, wet, 0]


def test_friction_per_pixel_by_hand():
    state = np.array([[State.DRY, State.DRY, State.WET, State.NO_CONTACT]])
    rise = np.array([[1.0, 2.0, 5.0, 0.0]])
    mu = friction_map(state, rise, P_AV, SLIDING)
    dry = (0.19 + 2.22) / 1e-4 * (2 / 3) / (2e5 * 1.5)
    wet = (0.19 + 0.56) / 1e-4 * (1 / 3) / (2e5 * 1.5)
    assert mu == pytest.approx(np.array([[dry, 2 * dry, 5 * wet, 0.0]]))


def test_balance_closes_and_is_inverse_to_the_depth():
    rng = np.random.default_rng(1)
    rise = rng.uniform(0.0, 6.0, (20, 30))
    state = classify(rise - 4.0, rng.uniform(size=rise.shape) > 0.2)
    balance = heat_balance(state, rise, 1e-6, P_AV, SLIDING)
    area = 1e-6 * np.count_nonzero(state)
    generated = balance.mu * P_AV * 3.0 * 0.5 * area  # (3.4)
    assert generated == pytest.approx(balance.ice + balance.tread + balance.water)
    twice = heat_balance(state, rise, 1e-6, P_AV, replace(SLIDING, depth=2e-4))
    assert twice.mu == pytest.approx(balance.mu / 2)


def test_where_all_pixels_share_a_state_map_and_balance_agree():
    rise = np.array([[0.5, 1.0, 1.5]])
    state = classify(rise - 4.0, rise > 0.0)
    mu = friction_map(state, rise, P_AV, SLIDING)
    assert mu.mean() == pytest.approx(heat_balance(state, rise, 1e-6, P_AV, SLIDING).mu)


def test_table_1_and_derived_properties():
    assert TABLE_1_ICE.diffusivity == pytest.approx(1.1974e-6, rel=1e-4)
    assert TABLE_1_ICE.effusivity == pytest.approx(2028.7, rel=1e-4)
    assert TABLE_1_RUBBER == Solid(conductivity=0.19, density=940.0, heat_capacity=1500.0)


def test_navin_on_ice_at_minus_4():
    assert reference.navin(269.15) == pytest.approx(0.1308)
    assert reference.navin(269.15, 500.0) == pytest.approx(0.2308)


def test_hayhoe_and_shapleys_film_solves_their_equation():
    A, B = reference.hayhoe_shapley_coefficients(3.0, 269.15)
    x, dx = np.array([1e-3, 0.1]), 1e-8
    h = reference.hayhoe_shapley_film(A, B, x)
    slope = (reference.hayhoe_shapley_film(A, B, x + dx) - h) / dx
    assert slope == pytest.approx(A / h - B / np.sqrt(x), rel=1e-5)


def test_hayhoe_and_shapleys_film_is_the_saturated_film_of_full_contact():
    v, T_0, x = 3.0, MELTING_TEMPERATURE - 4.0, 0.05
    film = reference.hayhoe_shapley_film(*reference.hayhoe_shapley_coefficients(v, T_0), x)
    saturated = reference.saturated_film(reference.melt_coefficient(1.0, v), T_0, x / v)
    assert film == pytest.approx(float(saturated))


def test_pengs_formulas_between_dry_and_wet():
    U, h, p, length, dry = 3.0, 1e-7, 2e5, 0.15, 0.1
    viscous = 1.8e-3 * U / (h * p)
    right = reference.peng_rectangle(U, h, p, [0.0, 0.05, length], length, dry)
    assert right == pytest.approx([dry, viscous / 3 + dry * 2 / 3, viscous])
    ellipse = reference.peng_ellipse(U, h, p, [0.0, length], [0.0, np.pi / 2], length, dry)
    assert ellipse == pytest.approx([dry, viscous])
    # As printed, a wet contact keeps most of its dry friction.
    printed = reference.peng_rectangle_as_printed(U, h, p, length, length, dry)
    assert printed > dry * (1.0 - 1.0 / np.pi)


def test_stopping_distance_is_that_of_uniform_braking():
    expected = (36.0 / 3.6) ** 2 / (2.0 * 9.81 * 0.1)
    assert reference.stopping_distance(36.0 / 3.6, 0.1) == pytest.approx(expected, rel=2e-3)
