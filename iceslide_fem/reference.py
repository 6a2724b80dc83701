"""Closed-form solutions of parts of the model, and formulas of others, for comparisons.

SI units; every function broadcasts over its arguments. K1, K2, K3 are the coefficients of the
thesis's film equation dh/dt = K1/h - q_ice/(rho L) - K3 h^3. (1.1) to (1.7) are friction on ice in
chapter 2 of the thesis: `stopping_distance`, `navin`, `hayhoe_shapley`, `peng_ellipse`,
`peng_rectangle`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import erf, erfc, erfcx

from iceslide_fem.film.loads import squeeze_rate
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import (
    ICE,
    ICE_CONDUCTIVITY,
    ICE_DENSITY,
    ICE_DIFFUSIVITY,
    ICE_EFFUSIVITY,
    ICE_HEAT_CAPACITY,
    LATENT_HEAT,
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
    Solid,
)

LAST_IMAGE = 6.0  # ierfc(6) is 1e-18: farther image sources are negligible


def _arrays(*values: ArrayLike) -> list[Array]:
    return [np.asarray(value, dtype=float) for value in values]


def melt_coefficient(k: ArrayLike, v: ArrayLike) -> Array:
    """K1 = k eta v^2 / (rho L), m2/s: friction heat that only melts ice, (5.23)."""
    k, v = _arrays(k, v)
    return k * WATER_VISCOSITY * v**2 / MELTING_ENTHALPY


def squeeze_coefficient(p: ArrayLike, D: ArrayLike) -> Array:
    """K3 = 8 p / (3 eta D^2), 1/(m2 s): squeeze-out rate dh/dt = -K3 h^3, (6.5)."""
    return squeeze_rate(*_arrays(p, D))


def squeezed_film(h0: ArrayLike, K3: ArrayLike, t: ArrayLike) -> Array:
    """Film height (m) under squeeze-out alone: h = h0 / sqrt(1 + 2 K3 h0^2 t)."""
    h0, K3, t = _arrays(h0, K3, t)
    return h0 / np.sqrt(1.0 + 2.0 * K3 * h0**2 * t)


def melting_film(h0: ArrayLike, K1: ArrayLike, t: ArrayLike) -> Array:
    """Film height (m) when all friction heat melts ice: h^2 = h0^2 + 2 K1 t."""
    h0, K1, t = _arrays(h0, K1, t)
    return np.sqrt(h0**2 + 2.0 * K1 * t)


def saturated_film(K1: ArrayLike, T_0: ArrayLike, t: ArrayLike) -> Array:
    """Film height (m) without squeeze-out under the closed-form ice flux (5.6).

    h = c sqrt(t) with c = -K2 + sqrt(K2^2 + 2 K1), K2 = flux coefficient / (rho L); T_0 in K.
    """
    K1, t = _arrays(K1, t)
    K2 = step_flux(T_0, 1.0) / MELTING_ENTHALPY
    return (-K2 + np.sqrt(K2**2 + 2.0 * K1)) * np.sqrt(t)


def balanced_film(K1: ArrayLike, K3: ArrayLike) -> Array:
    """Steady film height (m) of melting against squeeze-out, no conduction: (K1/K3)^(1/4)."""
    K1, K3 = _arrays(K1, K3)
    return (K1 / K3) ** 0.25


def step_flux(T_0: ArrayLike, t: ArrayLike) -> Array:
    """Flux (W/m2) into a half-space at T_0 whose surface jumps to T_m at t = 0, (5.6)."""
    T_0, t = _arrays(T_0, t)
    return ICE_CONDUCTIVITY * (MELTING_TEMPERATURE - T_0) / np.sqrt(np.pi * ICE_DIFFUSIVITY * t)


def constant_flux_rise(q: ArrayLike, t: ArrayLike) -> Array:
    """Surface temperature rise (K) of a half-space under constant flux: 2 q sqrt(t/pi) / e."""
    q, t = _arrays(q, t)
    return 2.0 * q * np.sqrt(t / np.pi) / ICE_EFFUSIVITY


def held_layer_rise(
    q: ArrayLike, depth: ArrayLike, conductivity: ArrayLike = ICE_CONDUCTIVITY
) -> Array:
    """Steady surface temperature (K) of a layer above that of its held base, under constant flux.

    T_i - T_0 = q d / lambda: q in W/m2, depth d in m, conductivity lambda in W/(m K). Source:
    H. S. Carslaw and J. C. Jaeger, Conduction of Heat in Solids, 2nd ed., Oxford 1959.
    """
    q, depth, conductivity = _arrays(q, depth, conductivity)
    return q * depth / conductivity


def layered_rise(
    q: ArrayLike, t: ArrayLike, depth: ArrayLike, below: Solid, ice: Solid = ICE
) -> Array:
    """Surface temperature rise (K) of ice on a half-space of another solid, under constant flux.

    (2 q sqrt(t) / e_1) [1 / sqrt(pi) + 2 sum_{n >= 1} G^n ierfc(n d / sqrt(alpha_1 t))] with
    G = (e_1 - e_2) / (e_1 + e_2), e = sqrt(lambda rho c) of the ice (1) and of the solid below (2),
    ierfc(x) = exp(-x^2) / sqrt(pi) - x erfc(x): q in W/m2 from t = 0 s on, ice of depth d in m.
    Source: H. S. Carslaw and J. C. Jaeger, Conduction of Heat in Solids, 2nd ed., Oxford 1959.
    """
    q, t, depth = _arrays(q, t, depth)
    e_1, e_2 = ice.effusivity, below.effusivity
    reached = np.asarray(depth / np.sqrt(ice.diffusivity * t))
    terms = 2 + int(LAST_IMAGE / np.min(reached))
    n = np.arange(1, terms).reshape(-1, *(1,) * reached.ndim)
    x = n * reached
    ierfc = np.exp(-(x**2)) / np.sqrt(np.pi) - x * erfc(x)
    images = np.sum(((e_1 - e_2) / (e_1 + e_2)) ** n * ierfc, axis=0)
    return 2.0 * q * np.sqrt(t) / e_1 * (1.0 / np.sqrt(np.pi) + 2.0 * images)


def squeezing_rise(viscous: ArrayLike, v: ArrayLike, h0: float, K3: float, t: ArrayLike) -> Array:
    """Surface temperature rise (K) of ice below a film that is squeezed out and does not melt.

    Duhamel's integral of the friction power q = c v / h with h of `squeezed_film`:
    c v / (h0 e sqrt(pi)) * [sqrt(t) + (1 + a t) / sqrt(a) * atan(sqrt(a t))], a = 2 K3 h0^2.
    `viscous` is c = k eta v (Pa m).
    """
    c, v, t = _arrays(viscous, v, t)
    a = 2.0 * K3 * h0**2
    integral = np.sqrt(t) + (1.0 + a * t) / np.sqrt(a) * np.arctan(np.sqrt(a * t))
    return c * v / (h0 * ICE_EFFUSIVITY * np.sqrt(np.pi)) * integral


def flux_after_onset(q: ArrayLike, t_melt: ArrayLike, t: ArrayLike) -> Array:
    """Flux (W/m2) into ice heated by constant q until t_melt, then held at T_m.

    q_ice = (2 q / pi) asin(sqrt(t_melt / t)) for t >= t_melt.
    """
    q, t_melt, t = _arrays(q, t_melt, t)
    return 2.0 * q / np.pi * np.arcsin(np.sqrt(t_melt / t))


def melted_depth(q: ArrayLike, t_melt: ArrayLike, t: ArrayLike) -> Array:
    """Depth of ice (m) melted by constant q at a surface that is at T_m from t_melt on.

    Friction heat minus the integral of `flux_after_onset`, over rho L, for t >= t_melt:

    rho L s = q t - (2 q / pi) [t asin(sqrt(t_melt / t)) + sqrt(t_melt (t - t_melt))].
    The surface does not move: a Stefan problem with melt much thinner than the warm layer.
    """
    q, t_melt, t = _arrays(q, t_melt, t)
    in_ice = t * np.arcsin(np.sqrt(t_melt / t)) + np.sqrt(t_melt * (t - t_melt))
    return (q * t - 2.0 * q / np.pi * in_ice) / MELTING_ENTHALPY


def band_source_rise(q: ArrayLike, length: ArrayLike, v: ArrayLike) -> Array:
    """Largest surface temperature rise (K) under a band source at high Peclet number.

    2 q sqrt(L / (pi v)) / e at the trailing edge; the mean over the band is 2/3 of it.
    """
    q, length, v = _arrays(q, length, v)
    return 2.0 * q * np.sqrt(length / (np.pi * v)) / ICE_EFFUSIVITY


def stefan_depth(undercooling: float, t: ArrayLike) -> Array:
    """Frozen depth (m) of the one-phase Stefan problem, surface `undercooling` K below T_m.

    s = 2 beta sqrt(alpha t), sqrt(pi) beta exp(beta^2) erf(beta) = c dT / L.
    """
    stefan = ICE_HEAT_CAPACITY * undercooling / LATENT_HEAT
    beta = brentq(lambda b: np.sqrt(np.pi) * b * np.exp(b**2) * erf(b) - stefan, 1e-6, 5.0)
    (t,) = _arrays(t)
    return 2.0 * beta * np.sqrt(ICE_CONDUCTIVITY / (ICE_DENSITY * ICE_HEAT_CAPACITY) * t)


def uniaxial_stress(stretch: ArrayLike, C10: float, C01: float) -> Array:
    """Cauchy stress (Pa) of incompressible Mooney-Rivlin rubber in uniaxial tension.

    sigma = 2 (l^2 - 1/l) (C10 + C01 / l).
    """
    (stretch,) = _arrays(stretch)
    return 2.0 * (stretch**2 - 1.0 / stretch) * (C10 + C01 / stretch)


def dry_softening_friction(
    time: Array,
    pressure: float,
    speed: float,
    k: float,
    stress: float,
    softening: float,
    celsius: float,
) -> tuple[Array, Array, Array]:
    """mu(t), its mean up to t, and surface temperature (degC) of dry rubber on half-space ice.

    Without melting, for a stress tau_b = stress (T_m - T) / softening on ice that began at
    `celsius`, not stronger than `stress`: with B = k stress v / softening and x = B sqrt(alpha t) /
    lambda the surface's distance from T_m falls as erfcx(x) = exp(x^2) erfc(x) (H. S. Carslaw, J.
    C. Jaeger, Conduction of Heat in Solids, 1959, 2.7).

    time (s), pressure (Pa), speed (m/s), stress (Pa), softening (K).
    """
    first = k * stress / pressure * -celsius / softening
    x = k * stress * speed / softening * np.sqrt(ICE.diffusivity * time) / ICE.conductivity
    left = erfcx(x)
    mean = (2.0 * x / np.sqrt(np.pi) - 1.0 + left) / x**2
    return first * left, first * mean, celsius * left


def refrozen_height(q: ArrayLike, t_melt: ArrayLike, stop: ArrayLike, t: ArrayLike) -> Array:
    """Height of water (m) at `t` on ice under the flux q (W/m2) until `stop` (s), then without.

    The surface stays at T_m until all water is frozen, so the ice takes the flux of
    `flux_after_onset`: the height is `melted_depth` minus q (t - stop) / (rho L). The motion of the
    freezing front is neglected. Negative after all water is frozen.
    """
    q, stop, t = _arrays(q, stop, t)
    return melted_depth(q, t_melt, t) - q * np.maximum(t - stop, 0.0) / MELTING_ENTHALPY


def frozen_onto(undercooling: float, t: ArrayLike, moves: bool = False) -> Array:
    """Height of water (m) at T_m frozen onto ice `undercooling` K below T_m, after t (s).

    s = 2 beta sqrt(alpha t), with beta = c dT / (L sqrt(pi)) for a fixed surface, and sqrt(pi) beta
    exp(beta^2) erfc(-beta) = c dT / L for a front that `moves` into the water.
    """
    stefan = ICE_HEAT_CAPACITY * undercooling / LATENT_HEAT
    beta = stefan / np.sqrt(np.pi)
    if moves:
        root = brentq(
            lambda b: np.sqrt(np.pi) * b * np.exp(b**2) * erfc(-b) - stefan, 0.0, 5.0, xtol=1e-14
        )
        beta = float(root)
    (t,) = _arrays(t)
    return 2.0 * beta * np.sqrt(ICE_DIFFUSIVITY * t)


def rise_before_pass(q: ArrayLike, time: ArrayLike, period: float, passes: int) -> Array:
    """Rise (K) of a half-space's surface after `passes` of a flux q (W/m2), before the next one.

    Each pass takes the `time` t_c (s) and begins a `period` (s) after the last one:

        dT = 2 q / (e sqrt(pi)) sum over passes of (sqrt(a) - sqrt(a - t_c)),

    with the time a since the start of each pass.
    """
    q, time = _arrays(q, time)
    since = period * np.arange(1, passes + 1)
    steps = np.sqrt(since) - np.sqrt(since - time)
    return 2.0 * q / (ICE_EFFUSIVITY * np.sqrt(np.pi)) * steps.sum()


def stopping_distance(speed: ArrayLike, mu: ArrayLike) -> Array:
    """d = V^2 / (254 mu), (1.1), in m; V is the speed (m/s) in km/h."""
    speed, mu = _arrays(speed, mu)
    return (3.6 * speed) ** 2 / (254.0 * mu)


def navin(temperature: ArrayLike, aggregate: ArrayLike = 0.0) -> Array:
    """f_x = 0.11 - 0.0052 T + 0.0002 A, (1.2): T is the `temperature` (K) in degC (<= 0).

    aggregate A < 1000 g/m2. The thesis prints 0:0052 and 0:0002.
    """
    temperature, aggregate = _arrays(temperature, aggregate)
    return 0.11 - 0.0052 * (temperature - ZERO_CELSIUS) + 0.0002 * aggregate


def hayhoe_shapley_coefficients(v: ArrayLike, T_0: ArrayLike) -> tuple[Array, Array]:
    """A (m) and B (m^0.5) of (1.3) to (1.5) for sliding at v (m/s) on ice at T_0 (K, below T_m).

    The melt flux of a film that grows by dh/dx is rho L v dh/dx, the friction power is eta v^2 / h,
    and the flux into the ice is e (T_m - T_0) sqrt(v / (pi x)):

        A = eta v / (rho L),  B = e (T_m - T_0) / (rho L sqrt(pi v)) .

    (1.5) prints the friction flux below the conduction flux; (1.3) needs the melt flux there, as in
    (1.4). Conduction is into the ice only, because the project has no data of the tyre.
    """
    v, T_0 = _arrays(v, T_0)
    A = WATER_VISCOSITY * v / MELTING_ENTHALPY
    B = ICE_EFFUSIVITY * (MELTING_TEMPERATURE - T_0) / (MELTING_ENTHALPY * np.sqrt(np.pi * v))
    return A, B


def hayhoe_shapley_film(A: ArrayLike, B: ArrayLike, x: ArrayLike) -> Array:
    """Film height (m) at x > 0 (m) from the leading edge: dh/dx = A/h - B/sqrt(x), (1.3).

    The solution that starts with h = 0: h = c sqrt(x), c = -B + sqrt(B^2 + 2 A).
    """
    A, B, x = _arrays(A, B, x)
    return (-B + np.sqrt(B**2 + 2.0 * A)) * np.sqrt(x)


def hayhoe_shapley(
    pressure: ArrayLike, speed: ArrayLike, temperature: ArrayLike, length: ArrayLike
) -> Array:
    """Mean viscous friction eta v / (h p), sliding at v (m/s) on a smooth contact of `length` (m).

    pressure p: mean, Pa; temperature: of the ice, K. The mean of 1 / (c sqrt(x)) is
    2 / (c sqrt(length)). Full contact, no squeeze-out.
    """
    p, v, length = _arrays(pressure, speed, length)
    mean_inverse = 2.0 / hayhoe_shapley_film(*hayhoe_shapley_coefficients(v, temperature), length)
    return WATER_VISCOSITY * v * mean_inverse / p


def peng_ellipse(
    speed: ArrayLike,
    film: ArrayLike,
    pressure: ArrayLike,
    x_m: ArrayLike,
    y_m: ArrayLike,
    length: ArrayLike,
    dry: ArrayLike,
) -> Array:
    """Mean friction of an elliptical contact, (1.6) as printed.

    f_m = eta U_s / (h p_0) 2 x_m y_m / (pi l) + f_d (l - x_m)(pi - 2 y_m) / (pi l): sliding speed
    U_s (m/s), film height h (m), mean pressure p_0 (Pa), 0 <= x_m <= l, the length (m), dry
    friction f_d. The thesis does not define y_m: from (pi - 2 y_m) an angle, 0 to pi/2. It calls
    x_m the length of the dry area, but in the formula it is that of the wet one: x_m = y_m = 0
    gives f_d. The sum of both weights is 1 at the ends only.
    """
    U_s, h, p_0, x_m, y_m, length, f_d = _arrays(speed, film, pressure, x_m, y_m, length, dry)
    viscous = WATER_VISCOSITY * U_s / (h * p_0)
    of_dry = f_d * (length - x_m) * (np.pi - 2.0 * y_m) / (np.pi * length)
    return viscous * 2.0 * x_m * y_m / (np.pi * length) + of_dry


def peng_rectangle(
    speed: ArrayLike,
    film: ArrayLike,
    pressure: ArrayLike,
    x_m: ArrayLike,
    length: ArrayLike,
    dry: ArrayLike,
) -> Array:
    """Mean friction of a rectangular contact: (1.7) with weights that are fractions of the length.

    f_m = eta U_s / (h p_0) x_m / l + f_d (1 - x_m / l), x_m (m) the length of the wet area; other
    arguments as for `peng_ellipse`.
    """
    U_s, h, p_0, x_m, length, f_d = _arrays(speed, film, pressure, x_m, length, dry)
    viscous = WATER_VISCOSITY * U_s / (h * p_0)
    return viscous * x_m / length + f_d * (1.0 - x_m / length)


def peng_rectangle_as_printed(
    speed: ArrayLike,
    film: ArrayLike,
    pressure: ArrayLike,
    x_m: ArrayLike,
    length: ArrayLike,
    dry: ArrayLike,
) -> Array:
    """(1.7) as printed: f_m = eta U_s / (h p_0) x_m^2 / (pi l) + f_d (1 - x_m / (pi l)).

    Arguments as for `peng_rectangle`. The first weight is a length, and a contact that is wet all
    over keeps 1 - 1/pi of its dry friction.
    """
    U_s, h, p_0, x_m, length, f_d = _arrays(speed, film, pressure, x_m, length, dry)
    viscous = WATER_VISCOSITY * U_s / (h * p_0)
    return viscous * x_m**2 / (np.pi * length) + f_d * (1.0 - x_m / (np.pi * length))
