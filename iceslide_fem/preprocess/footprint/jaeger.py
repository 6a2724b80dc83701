"""Module 2: friction heat under the footprint and the temperature rise of the ice.

It has the thesis's form, (3.1) to (3.3) and (4.1), as printed, and a moving heat source. For the
latter every line along x is a half-space with the flux history of the pixels that it passes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import irfft, next_fast_len, rfft

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import ICE_EFFUSIVITY, Solid, rubber_solid

# Table 1 of the thesis. Its ice differs from that of the film law (917.8 for 916 kg/m3, 2.22 for
# 2.25 W/(m K), 2020 for 2220 J/(kg K)).
TABLE_1_ICE = Solid(conductivity=2.22, density=917.8, heat_capacity=2020.0)
TABLE_1_RUBBER = rubber_solid(940.0)


def friction_flux(mu_st: ArrayLike, p: ArrayLike, V: ArrayLike, S: ArrayLike) -> Array:
    """Q = mu_st p V S, (3.2), in W/m2: 1 x Pa x m/s x 1.

    The thesis's nomenclature calls Q "instantaneously generated heat (J)".
    """
    mu_st, p, V, S = (np.asarray(value, dtype=float) for value in (mu_st, p, V, S))
    return mu_st * p * V * S


def jaeger_rise(Q: ArrayLike, distance: ArrayLike, t: ArrayLike, solid: Solid) -> Array:
    """dT = Q alpha / (8 k (pi alpha t)^(3/2)) exp(-r^2 / (4 alpha t)), (3.3) and (4.1) as printed.

    `distance` r (m) between source and point, `t` (s) since the heat was released. With Q in J this
    is the rise (K) around an instantaneous point source in an infinite solid: J m2/s over W/(m K)
    m3 is K. With Q in W/m2, as in (3.2), the unit is K/(m2 s). The thesis reads the number as K: it
    takes the heat of 1 m2 in 1 s as that of a point. (4.1) uses the distance along x only, and
    keeps the three-dimensional prefactor.
    """
    Q, r, t = (np.asarray(value, dtype=float) for value in (Q, distance, t))
    a = solid.diffusivity
    scale = Q * a / (8.0 * solid.conductivity * (np.pi * a * t) ** 1.5)
    return np.asarray(scale * np.exp(-(r**2) / (4.0 * a * t)))


def jaeger_exposure(Q: float, rise: float, solid: Solid) -> float:
    """The time t (s) at which (3.3) at distance 0 gives `rise` (K) with Q (W/m2, read as J)."""
    a, k = solid.diffusivity, solid.conductivity
    return float((Q * a / (8.0 * k * rise)) ** (2.0 / 3.0) / (np.pi * a))


def next_pixel_rise(flux: Array, dx: float, t: float, solid: Solid) -> Array:
    """Rise map (K) by (3.3) with the next pixel along x as the only source, as in the thesis.

    flux: (..., nx), from (3.2). The last pixel of a line has no source.
    """
    rise = np.zeros_like(flux)
    rise[..., :-1] = jaeger_rise(flux[..., 1:], dx, t, solid)
    return rise


def moving_source_rise(
    flux: Array, dx: float, V: float, effusivity: float = ICE_EFFUSIVITY
) -> Array:
    """Rise (K) of the ice where it leaves each pixel, below a source that moves towards +x.

    `flux` (W/m2), shape (..., nx), constant over a pixel; ice passes with V (m/s) from the last
    pixel to the first. Duhamel's integral for a half-space, exact for such a flux:

        dT_n = 2 / (e sqrt(pi)) sum_j q_j (sqrt(t_n - t_(j-1)) - sqrt(t_n - t_j)) .

    All heat flows into the ice and nothing melts, so the rise may exceed T_m - T_0. At the end of a
    uniform band it has the closed form `reference.band_source_rise`. Conduction along x and y is
    neglected: the diffusion length sqrt(alpha L / V) is 0.26 mm for L = 0.18 m at 3 m/s.
    """
    n = flux.shape[-1]
    steps = np.sqrt(np.arange(n + 1.0))
    kernel = 2.0 / effusivity * np.sqrt(dx / (np.pi * V)) * np.diff(steps)
    size = next_fast_len(2 * n - 1, real=True)
    rise = irfft(rfft(flux[..., ::-1], size) * rfft(kernel, size), size)[..., :n]
    return np.maximum(rise[..., ::-1], 0.0)  # negative by rounding of the transforms
