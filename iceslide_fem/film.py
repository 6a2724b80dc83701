"""The film-height friction law at contact points: pure functions of arrays.

A water film of height h separates the asperity tops from the ice and is sheared by the sliding
speed v. Equation numbers are those of R. Leonardi's thesis (Politecnico di Torino, 2017-18):

    shear stress      tau = k eta v / h                                   (5.29)
    friction power    q_f = tau v                                         (5.3, 5.10)
    film              dh/dt = q_melt / (rho L) - [H_s < H_V] K3 h^3       (5.23)
    squeezed out      dH_s/dt = [H_s < H_V] K3 h^3                        (5.21)
    squeeze rate      K3 = 8 p / (3 eta D^2)                              (6.5)

Melting is a complementarity at every point and instant: the film's temperature does not exceed
the melting temperature, q_melt = q_f - q_ice does not become negative, and one of the two is at
its bound. (The thesis prints the melting switch as T < T_m in (5.13), (5.23) and (5.32); it must
be T = T_m as in (5.8).)

The height is advanced as y = ln h: it stays positive for any step, and an error of y is the
relative error of the shear stress.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.materials import (
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
    Array,
    Index,
    Mask,
)

# Newton's last change of ln h; what is left is of the order of its square.
_NEWTON_TOLERANCE = 1e-7
_NEWTON_ITERATIONS = 80
# Changes of ln h from which on Newton's method needs no safeguard: the residual is a sum of
# exponentials of at most 2 ln h.
_FAR = 0.1


class FilmLoads(NamedTuple):
    """What acts on the film at each point; arrays of one shape.

    viscous: c = k eta v (Pa m), so that tau = c / h; speed: v (m/s); squeeze_rate: K3
    (1/(m2 s)); free_height: H_V (m).
    """

    viscous: Array
    speed: Array
    squeeze_rate: Array
    free_height: Array


def film_loads(pressure: Array, speed: Array, k: Array, D: Array, H_V: Array) -> FilmLoads:
    """Loads at `pressure` (Pa) and `speed` (m/s) for contact parameters k, D (m), H_V (m).

    c = k eta v of (5.29), K3 = 8 p / (3 eta D^2) of (6.5); no squeeze-out where p <= 0.
    """
    squeeze_rate = 8.0 * np.maximum(pressure, 0.0) / (3.0 * WATER_VISCOSITY * D**2)
    return FilmLoads(k * WATER_VISCOSITY * speed, speed, squeeze_rate, H_V)


def interpolate(start: FilmLoads, end: FilmLoads, fraction: float) -> FilmLoads:
    """Loads at `fraction` of a step, on straight lines between its ends."""
    if start is end:
        return start
    return FilmLoads(*(a + fraction * (b - a) for a, b in zip(start, end, strict=True)))


class IceSurface(NamedTuple):
    """The ice's answer within one implicit stage, as the film sees it; arrays.

    The surface takes the temperature `offset` + `resistance` * q (K, K m2/W) under the flux q,
    and draws the flux `melted_flux` (W/m2) when it is at the melting temperature.
    """

    offset: Array
    resistance: Array
    melted_flux: Array


class FilmStage(NamedTuple):
    """Film and energy balance at the end of one implicit stage; arrays of one shape.

    log_height: ln(h / 1 m); squeezed_height: H_s (m); friction_power, ice_flux, melt_power: q_f,
    q_ice, q_melt (W/m2), with q_f = q_ice + q_melt; dry_temperature: the surface temperature
    (K) without melting; melting, saturated: which switches are on; overfill: how far H_s would
    be above H_V (m, negative below) if the free volume were not limited.
    """

    log_height: Array
    squeezed_height: Array
    friction_power: Array
    ice_flux: Array
    melt_power: Array
    dry_temperature: Array
    melting: Mask
    saturated: Mask
    overfill: Array


def implicit_stage(
    log_height: Array, squeezed: Array, dt: Array | float, loads: FilmLoads, ice: IceSurface
) -> FilmStage:
    """Solve (5.21), (5.23) and the melting complementarity implicitly over `dt` (s).

    `log_height` and `squeezed` (ln m, m) are the values that the stage starts from; the result
    fulfils value = start + dt * rate(value). Melting starts where the dry film would be warmer
    than T_m; saturation limits squeeze-out to the volume still free.
    """
    none = np.zeros_like(log_height)
    y_dry, squeeze, overfill = _height(log_height, squeezed, dt, loads, none, none)
    q_dry = loads.viscous * loads.speed * np.exp(-y_dry)
    dry_temperature = ice.offset + ice.resistance * q_dry
    melting = (dry_temperature > MELTING_TEMPERATURE) & (q_dry > ice.melted_flux)

    y, q_f, q_ice = y_dry.copy(), q_dry.copy(), q_dry.copy()
    wet = np.flatnonzero(melting)
    if wet.size:
        some = FilmLoads(*(load[wet] for load in loads))
        q_ice[wet] = ice.melted_flux[wet]
        heating = some.viscous * some.speed / MELTING_ENTHALPY
        cooling = q_ice[wet] / MELTING_ENTHALPY
        y[wet], squeeze[wet], overfill[wet] = _height(
            log_height[wet], squeezed[wet], _pick(dt, wet), some, heating, cooling
        )
        q_f[wet] = some.viscous * some.speed * np.exp(-y[wet])
    return FilmStage(
        y,
        squeezed + dt * squeeze,
        q_f,
        q_ice,
        q_f - q_ice,
        dry_temperature,
        melting,
        overfill > 0.0,
        overfill,
    )


def explicit_stage(
    log_height: Array, squeezed: Array, dt: Array | float, loads: FilmLoads, ice: IceSurface
) -> FilmStage:
    """One explicit Euler step of (5.21) and (5.23), the thesis's method, for comparison.

    Rates are those of the starting height, switches those of the starting state. The height is
    NaN where the step is too large and empties the film.
    """
    h = np.exp(log_height)
    q_f = loads.viscous * loads.speed / h
    dry_temperature = ice.offset + ice.resistance * q_f
    melting = (dry_temperature > MELTING_TEMPERATURE) & (q_f > ice.melted_flux)
    q_ice = np.where(melting, ice.melted_flux, q_f)
    squeeze = loads.squeeze_rate * h**3
    overfill = squeezed + dt * squeeze - loads.free_height
    squeeze = np.where(overfill > 0.0, (loads.free_height - squeezed) / dt, squeeze)
    new = h + dt * ((q_f - q_ice) / MELTING_ENTHALPY - squeeze)
    y = np.log(np.where(new > 0.0, new, np.nan))
    return FilmStage(
        y,
        squeezed + dt * squeeze,
        q_f,
        q_ice,
        q_f - q_ice,
        dry_temperature,
        melting,
        overfill > 0.0,
        overfill,
    )


def _pick(dt: Array | float, index: Index) -> Array | float:
    return dt if np.ndim(dt) == 0 else np.asarray(dt)[index]


def _height(
    y_start: Array,
    squeezed: Array,
    dt: Array | float,
    loads: FilmLoads,
    heating: Array,
    cooling: Array,
) -> tuple[Array, Array, Array]:
    """ln h, squeeze-out rate (m/s) and overfill (m) of one implicit stage.

    First as if free volume were unlimited; where that overfills it, with the squeeze-out that
    just fills it (negative where earlier stages of the step overshot). `heating` = c v / (rho L)
    and `cooling` = q_ice / (rho L) act where it melts.
    """
    zero = np.zeros_like(y_start)
    y = _solve(y_start, dt, loads.squeeze_rate, zero, heating, cooling)
    squeeze = loads.squeeze_rate * np.exp(3.0 * y)
    overfill = squeezed + dt * squeeze - loads.free_height
    full = np.flatnonzero(overfill > 0.0)
    if full.size:
        dt_full = _pick(dt, full)
        squeeze[full] = (loads.free_height[full] - squeezed[full]) / dt_full
        y[full] = _solve(
            y_start[full], dt_full, zero[full], squeeze[full], heating[full], cooling[full]
        )
    return y, squeeze, overfill


def _solve(
    y_start: Array,
    dt: Array | float,
    K3: Array,
    squeeze: Array,
    heating: Array,
    cooling: Array,
) -> Array:
    """Root y of y - y_start + dt (K3 e^2y + squeeze e^-y - heating e^-2y + cooling e^-y) = 0.

    Newton's method; far from the root it is kept inside the bracket that the residual's signs
    give.
    """
    thinning_rate, loss_rate, gain_rate = dt * K3, dt * (squeeze + cooling), dt * heating
    y = y_start.copy()
    low = np.full_like(y, -np.inf)
    high = np.full_like(y, np.inf)
    for _ in range(_NEWTON_ITERATIONS):
        inverse = np.exp(-y)
        square = inverse * inverse
        thinning, loss, gain = thinning_rate / square, loss_rate * inverse, gain_rate * square
        residual = y - y_start + thinning + loss - gain
        change = -residual / np.maximum(1.0 + 2.0 * (thinning + gain) - loss, 0.1)
        largest = np.abs(change).max(initial=0.0)
        if largest > _FAR:
            low = np.where(residual < 0.0, y, low)
            high = np.where(residual >= 0.0, y, high)
            change = np.clip(change, -2.0, 2.0)
            new = y + change
            outside = (new <= low) | (new >= high)
            outside &= np.isfinite(low) & np.isfinite(high) & (np.abs(change) > _NEWTON_TOLERANCE)
            if outside.any():
                new[outside] = 0.5 * (low[outside] + high[outside])
            y = new
        else:
            y += change
            if largest <= _NEWTON_TOLERANCE:
                break
    return y
