"""The film-height friction law at contact points: pure functions of arrays.

A water film of height h separates the asperity tops from the ice and is sheared by the sliding
speed v. Equation numbers are those of R. Leonardi's thesis (Politecnico di Torino, 2017-18):

    shear stress      tau = k eta v / h                                   (5.29)
    friction power    q_f = tau v                                         (5.3, 5.10)
    film              dh/dt = q_melt / (rho L) - [H_s < H_V] K3 h^3       (5.23)
    squeezed out      dH_s/dt = [H_s < H_V] K3 h^3                        (5.21)
    squeeze rate      K3 = 8 p / (3 eta D^2)                              (6.5)

Melting is a complementarity at every point and instant: the film's temperature is at most the
melting temperature, q_melt = q_f - q_ice is not negative, and one of the two is at its bound. (The
thesis prints the melting switch as T < T_m in (5.13), (5.23) and (5.32); it must be T = T_m as in
(5.8).)

The height is advanced as y = ln h: h stays positive for any step, and an error of y is a relative
error of the shear stress.

With a temperature-dependent viscosity (`viscosity`), loads use a constant viscosity eta_0, and
ln(eta / eta_0) is an internal variable of the film.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.height import CLOSE, HeightEquation, log_height_of
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.materials import ICE, Solid


class FilmHistory(Protocol):
    """State of films: ln h, H_s (m), and internal variables (m, n).

    The latter are ln(eta / eta_0) for a temperature-dependent viscosity, or those of another law.
    """

    @property
    def log_height(self) -> Array:
        """ln(h / 1 m)."""

    @property
    def squeezed_height(self) -> Array:
        """H_s, m."""

    @property
    def internal(self) -> Array:
        """(m, n)."""


class FilmForcing(Protocol):
    """Loads of films; arrays (n,)."""

    @property
    def viscous(self) -> Array:
        """c = k eta v (Pa m)."""

    @property
    def speed(self) -> Array:
        """v, m/s."""

    @property
    def squeeze_rate(self) -> Array:
        """K3, 1/(m2 s)."""

    @property
    def free_height(self) -> Array:
        """H_V, m."""


def log_shearing(state: FilmHistory) -> Array:
    """ln(eta / (eta_0 h)) of films (h in m), so that tau = c times its exponential, (n,).

    It is linear in the state, so it also applies to changes of the state.
    """
    return state.internal[0] - state.log_height if len(state.internal) else -state.log_height


class Surface(NamedTuple):
    """Thermal response of a body in one implicit stage; arrays.

    The surface temperature is `offset` + `resistance` * q (K, K m2/W) under the flux q. At the
    melting temperature of its `solid` the surface takes `melted_flux` (W/m2). It melts if the
    friction power is larger. With heat in the rubber this is the joint response of both bodies, and
    q the sum of their fluxes, `into_rubber` (W/m2) the rubber's part of the `melted_flux`.
    """

    offset: Array
    resistance: Array
    melted_flux: Array
    solid: Solid = ICE
    into_rubber: Array | float = 0.0

    @classmethod
    def of(cls, offset: Array, resistance: Array, solid: Solid = ICE) -> Surface:
        """The response with `melted_flux` by conduction alone."""
        return cls(offset, resistance, (solid.melting_temperature - offset) / resistance, solid)


class FilmStage(NamedTuple):
    """Film and energy balance at the end of one implicit stage; arrays of one shape.

    log_height: ln(h / 1 m), or ln(h + s) (`limiting_shear`); squeezed_height: H_s (m);
    friction_power, ice_flux, melt_power: q_f, q_ice, q_melt (W/m2), with q_f = q_ice + q_melt;
    dry_temperature: surface temperature without melting in this stage, to first order, K; melting,
    saturated: masks of the two switches; overfill: H_s - H_V with unlimited free volume, m;
    ice_slope: resistance times - d q_ice / d offset, 1 where it melts, else 0; rubber_flux:
    q_rubber, then also a part of q_f, W/m2; internal: as in `FilmHistory`, (m, n); shearing: eta /
    (eta_0 h), 1/m; outflow: of water from full voids to the edges of a lug, m/s;
    hysteresis: heat made in the rubber on rough ice, W/m2, which is no part of q_f.
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
    ice_slope: Array
    rubber_flux: Array
    internal: Array = np.zeros((0, 1))
    shearing: Array = np.zeros(1)
    outflow: Array = np.zeros(1)
    hysteresis: Array = np.zeros(1)


class Film(Protocol):
    """The film (or another law) in one implicit stage, as the bodies use it.

    log_height: ln(h / 1 m) at the start; dt: length of the stage, s.
    """

    @property
    def log_height(self) -> Array:
        """ln(h / 1 m) at the start of the stage."""

    @property
    def dt(self) -> Array | float:
        """Length of the stage, s."""

    def height(self, log_height: Array) -> Array:
        """h (m) from `FilmStage.log_height`."""

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """Film and energy balance above `ice`; iterations may start at ln h = `near`."""


def implicit_stage(
    log_height: Array,
    squeezed: Array,
    dt: Array | float,
    loads: FilmForcing,
    ice: Surface,
    near: Array | None = None,
    close: float = CLOSE,
) -> FilmStage:
    """Solve (5.21), (5.23) and both complementarities implicitly over `dt` (s).

    `log_height` and `squeezed` (ln m, m) are the start values. The result fulfils value = start +
    dt * rate(value). The ice takes the friction power, at most the flux that holds its surface at
    T_m. Squeeze-out follows the pressure, and is limited by the volume still free (negative if
    earlier stages overshot). `near` and `close` are those of `log_height_of`. All values are NaN
    where no height is found.
    """
    power = loads.viscous * loads.speed
    room = loads.free_height - squeezed
    squeezing = dt * loads.squeeze_rate
    height = dt / ice.solid.melting_enthalpy  # melted height per power
    equation = HeightEquation(log_height, squeezing, room, height * power, height * ice.melted_flux)
    y, inverse = log_height_of(equation, near, close)
    q_f = power * inverse
    q_ice = np.minimum(q_f, ice.melted_flux)
    q_melt = q_f - q_ice
    flow = squeezing / (inverse * inverse * inverse)
    overfill = flow - room
    melting = q_melt > 0.0
    dry = height * q_melt
    dry *= inverse
    dry += 1.0
    dry *= q_f
    dry *= ice.resistance
    dry += ice.offset
    return FilmStage(
        y,
        squeezed + np.minimum(flow, room),
        q_f,
        q_ice,
        q_melt,
        dry,
        melting,
        overfill > 0.0,
        overfill,
        melting.astype(float),
        np.zeros_like(q_ice),
        shearing=inverse,
    )


def explicit_stage(
    log_height: Array,
    squeezed: Array,
    dt: Array | float,
    loads: FilmForcing,
    ice: Surface,
    near: Array | None = None,
    close: float = CLOSE,
    largest_change: float = 2.0,
) -> FilmStage:
    """One explicit Euler step of (5.21) and (5.23), the thesis's method, for comparison.

    Rates are those at the start; nothing is solved. The height is NaN if the step changes it by
    more than the factor `largest_change` or empties the film. The linear limit of stability, 2 / |d
    rate / d h|, bounds neither errors nor breakdown (docs/validation/stability.md).
    """
    h = np.exp(log_height)
    q_f = loads.viscous * loads.speed / h
    q_ice = np.minimum(q_f, ice.melted_flux)
    room = loads.free_height - squeezed
    overfill = dt * loads.squeeze_rate * h**3 - room
    squeeze = np.minimum(dt * loads.squeeze_rate * h**3, room)
    new = h + dt * (q_f - q_ice) / ice.solid.melting_enthalpy - squeeze
    kept = (new > h / largest_change) & (new < h * largest_change)
    y = np.log(np.where(kept, new, np.nan))
    melting = q_f > ice.melted_flux
    return FilmStage(
        y,
        squeezed + squeeze,
        q_f,
        q_ice,
        q_f - q_ice,
        ice.offset + ice.resistance * q_f,
        melting,
        overfill > 0.0,
        overfill,
        melting.astype(float),
        np.zeros_like(q_ice),
        shearing=np.exp(-y),
    )
