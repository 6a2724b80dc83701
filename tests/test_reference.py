"""Closed forms: printed values, and the differential equations that they solve."""

import numpy as np
import pytest
from scipy.integrate import quad

from iceslide_fem import reference
from iceslide_fem.scene.materials import (
    COMPOUNDS,
    ICE_CONDUCTIVITY,
    ICE_DIFFUSIVITY,
    ICE_EFFUSIVITY,
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
    MooneyRivlin,
)

pytestmark = pytest.mark.quick

T_0 = MELTING_TEMPERATURE - 4.0
K1 = reference.melt_coefficient(0.266, 3.0)
K3 = reference.squeeze_coefficient(1e5, 29e-6)
H0 = 70e-9


def slope(f, t: float, step: float = 1e-5) -> float:
    """Central difference of `f` at `t` with a relative step."""
    return float(f(t * (1 + step)) - f(t * (1 - step))) / (2 * step * t)


def test_effusivity():
    assert ICE_EFFUSIVITY == pytest.approx(2139.0, abs=0.5)


@pytest.mark.parametrize("t, rise", [(0.1e-3, 0.5275), (1e-3, 1.6682), (7e-3, 4.4136)])
def test_constant_flux(t, rise):
    assert reference.constant_flux_rise(1e5, t) == pytest.approx(rise, abs=1e-4)


@pytest.mark.parametrize("length, v, rise", [(1e-3, 3.0, 0.963), (20e-3, 4.0, 3.730)])
def test_band_source(length, v, rise):
    assert reference.band_source_rise(1e5, length, v) == pytest.approx(rise, abs=1e-3)


def test_band_source_is_constant_flux_for_the_transit_time():
    x = np.linspace(0.0, 1e-3, 100_001)
    rise = reference.constant_flux_rise(1e5, x / 3.0)
    largest = reference.band_source_rise(1e5, 1e-3, 3.0)
    assert rise[-1] == pytest.approx(largest)
    assert rise.mean() == pytest.approx(2.0 / 3.0 * largest, rel=1e-4)


def test_water_that_freezes_onto_ice():
    """2 e dT sqrt(t / pi) / (rho L) below a fixed surface; one that moves takes 1.7 % less."""
    fixed, moving = (reference.frozen_onto(4.0, 1e-3, moves) for moves in (False, True))
    exact = 2.0 * reference.ICE_EFFUSIVITY * 4.0 * np.sqrt(1e-3 / np.pi)
    assert fixed == pytest.approx(exact / reference.MELTING_ENTHALPY)
    assert 1.0 - moving / fixed == pytest.approx(0.0165, abs=5e-4)


def test_stefan_depth():
    assert reference.stefan_depth(4.0, 1.0) == pytest.approx(242.94e-6, abs=0.01e-6)
    assert reference.stefan_depth(4.0, 4.0) == pytest.approx(2 * reference.stefan_depth(4.0, 1.0))


def test_film_under_squeeze_out_solves_its_equation():
    def h(t):
        return reference.squeezed_film(H0, K3, t)

    assert h(0.0) == pytest.approx(H0)
    assert slope(h, 2e-3) == pytest.approx(-K3 * h(2e-3) ** 3, rel=1e-6)


def test_film_at_five_bar_before_melting():
    """36.46 nm at 0.8 ms: with k = 0.405 this gives the published mu = 0.12."""
    h = reference.squeezed_film(H0, reference.squeeze_coefficient(5e5, 46.5e-6), 0.8e-3)
    assert h == pytest.approx(36.46e-9, abs=0.01e-9)
    assert 0.405 * 1.8e-3 * 3.0 / h / 5e5 == pytest.approx(0.12, abs=1e-4)


def test_melting_film_solves_its_equation():
    def h(t):
        return reference.melting_film(H0, K1, t)

    assert slope(h, 1e-3) == pytest.approx(K1 / h(1e-3), rel=1e-6)


def test_saturated_film_solves_its_equation():
    def h(t):
        return reference.saturated_film(K1, T_0, t)

    rate = K1 / h(3e-3) - reference.step_flux(T_0, 3e-3) / MELTING_ENTHALPY
    assert slope(h, 3e-3) == pytest.approx(rate, rel=1e-6)


def test_balanced_film_neither_grows_nor_shrinks():
    h = reference.balanced_film(K1, K3)
    assert K1 / h == pytest.approx(K3 * h**3)


def test_step_flux_is_that_of_the_error_function_profile():
    t = 2e-3
    expected = ICE_CONDUCTIVITY * 4.0 / np.sqrt(np.pi * ICE_DIFFUSIVITY * t)
    assert reference.step_flux(T_0, t) == pytest.approx(expected)


def test_squeezing_rise_is_duhamels_integral():
    viscous, v, t = 0.266 * 1.8e-3 * 3.0, 3.0, 2e-3

    def integrand(root):  # root = sqrt(t - s) takes the singularity away
        q = viscous * v / reference.squeezed_film(H0, K3, t - root**2)
        return 2.0 * q / (ICE_EFFUSIVITY * np.sqrt(np.pi))

    rise, _ = quad(integrand, 0.0, np.sqrt(t), epsrel=1e-12)
    assert reference.squeezing_rise(viscous, v, H0, K3, t) == pytest.approx(rise, rel=1e-10)


def test_flux_after_onset_starts_at_the_constant_flux_and_keeps_the_surface_at_the_limit():
    q, t_melt, t = 3e5, 1e-3, 2.5e-3
    assert reference.flux_after_onset(q, t_melt, t_melt) == pytest.approx(q)

    def integrand(s, power):
        return power / np.sqrt(np.pi * (t - s)) / ICE_EFFUSIVITY

    before, _ = quad(integrand, 0.0, t_melt, args=(q,))
    after, _ = quad(
        lambda root: (
            2.0
            * reference.flux_after_onset(q, t_melt, t - root**2)
            / (ICE_EFFUSIVITY * np.sqrt(np.pi))
        ),
        0.0,
        np.sqrt(t - t_melt),
    )
    assert before + after == pytest.approx(reference.constant_flux_rise(q, t_melt), rel=1e-6)


def test_melted_depth_is_what_the_ice_does_not_take():
    q, t_melt, t = 3e5, 1e-3, 2.5e-3
    in_ice, _ = quad(lambda at: reference.flux_after_onset(q, t_melt, at), t_melt, t)
    expected = (q * (t - t_melt) - in_ice) / MELTING_ENTHALPY
    assert reference.melted_depth(q, t_melt, t) == pytest.approx(expected, rel=1e-9)
    assert reference.melted_depth(q, t_melt, t_melt) == pytest.approx(0.0, abs=1e-18)


def test_uniaxial_stress_is_the_derivative_of_the_energy():
    C10, C01, stretch = 0.1662e6, 0.1068e6, 1.7

    def energy(x):
        return C10 * (x**2 + 2 / x - 3) + C01 * (2 * x + 1 / x**2 - 3)

    nominal = slope(energy, stretch)
    stress = reference.uniaxial_stress(stretch, C10, C01)
    assert stress == pytest.approx(stretch * nominal, rel=1e-6)
    small = reference.uniaxial_stress(1.0 + 1e-6, C10, C01) / 1e-6
    assert small == pytest.approx(6.0 * (C10 + C01), rel=1e-5)


def test_constants_of_compound_B():
    material = COMPOUNDS["B"]
    assert material.poissons_ratio == pytest.approx(0.490, abs=5e-4)
    assert material.youngs_modulus == pytest.approx(1.64e6, rel=0.01)
    again = MooneyRivlin.from_nu(material.C10, material.C01, material.poissons_ratio)
    assert again.D1 == pytest.approx(material.D1)
