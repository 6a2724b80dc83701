"""Formulas of friction on ice in chapter 2 of the thesis, for comparison.

SI units; all functions broadcast over their arguments.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import (
    ICE_EFFUSIVITY,
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
)


def _arrays(*values: ArrayLike) -> list[Array]:
    return [np.asarray(value, dtype=float) for value in values]


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
