"""The thesis's modules 2 and 3: heat, dry or wet, friction (4.7) to (4.9), balance (3.4) to (3.8).

A line is a map of one row. Given maps of temperature and state replace the computed ones, as in the
thesis's flow chart (fig. 2). Symbols are those of the thesis: A in (4.7) to (4.9) is the area of
the pixel's class, d the depth of heat penetration, which the source of the model tuned to its
measurements.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.film.doubts import IN_DOUBT, LARGEST_FRICTION
from iceslide_fem.preprocess.footprint.jaeger import (
    TABLE_1_ICE,
    TABLE_1_RUBBER,
    friction_flux,
    moving_source_rise,
    next_pixel_rise,
)
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import (
    ICE_EFFUSIVITY,
    MELTING_TEMPERATURE,
    WATER_CONDUCTIVITY,
    Solid,
)

MIXED_FROM, WET_FROM = -2.0, 0.0  # degC
Source = Literal["next pixel", "moving"]
States = NDArray[np.uint8]


class State(IntEnum):
    """State of a pixel: dry below -2 degC, wet from 0 degC on, mixed between."""

    NO_CONTACT = 0
    DRY = 1
    MIXED = 2
    WET = 3


STATES = (State.DRY, State.MIXED, State.WET)


@dataclass(frozen=True)
class Macroscopic:
    """Every parameter of the macroscopic model; defaults are tables 1 and 2 of the thesis.

    speed V (m/s), slip S and static_friction mu_st: (3.1), (3.2). ice_temperature T_0 (K).
    air_temperature: of the air, and of the tread before contact, K; None for that of the ice, as in
    the thesis. source: heat source of a pixel: the next pixel by (3.3) and (4.1) after the time t
    (s), or all pixels passed (`moving_source_rise`, independent of t). depth d: of heat
    penetration, m, (3.5) to (3.7). ice, tread: thermal properties; ice is used in (3.3) and (3.5).
    effusivity (W s^0.5/(m2 K)): of the ice below the moving source. water_conductivity: W/(m K);
    the thesis prints none, the default is the project's.
    """

    speed: float = 3.0
    slip: float = 1e-5
    static_friction: float = 0.1
    ice_temperature: float = MELTING_TEMPERATURE - 4.0
    air_temperature: float | None = None
    source: Source = "next pixel"
    time: float = 1.0
    depth: float = 1e-4
    ice: Solid = TABLE_1_ICE
    tread: Solid = TABLE_1_RUBBER
    water_conductivity: float = WATER_CONDUCTIVITY
    effusivity: float = ICE_EFFUSIVITY

    @property
    def warmer_ice(self) -> float:
        """T_0 minus the temperature of the tread (K), added to dT in (3.6)."""
        return 0.0 if self.air_temperature is None else self.ice_temperature - self.air_temperature

    def power(self, mean_pressure: float) -> float:
        """p_av V S (W/m2): friction power over mu; p_av in Pa."""
        return mean_pressure * self.speed * self.slip


class HeatBalance(NamedTuple):
    """Heat flows of the whole contact (W), and the mean friction of their balance, (3.4) to
    (3.8).
    """

    ice: float
    tread: float
    water: float
    mu: float


class Edges(NamedTuple):
    """Mean temperatures (K) of the ice at the leading and trailing edge, 3.2.2."""

    leading: float
    trailing: float


class HeatModel(NamedTuple):
    """Modules 2 and 3; arrays (ny, nx) of a map, (nx,) of a line.

    x: middles of the pixels along the direction of travel, (nx,), m; pressure (Pa); flux: Q of
    (3.2), W/m2; rise: of the temperature (K); temperature: of the ice's surface (K); state: dry,
    mixed, wet; mu: (4.7) to (4.9), 0 where there is no contact; power: p_av V S, W/m2; balance:
    (3.4) to (3.8), of a line per metre of width.
    """

    x: Array
    pressure: Array
    flux: Array
    rise: Array
    temperature: Array
    state: States
    mu: Array
    power: float
    balance: HeatBalance

    @property
    def mu_mean(self) -> float:
        """Mean mu of the pixels in contact."""
        return float(self.mu[self.state != State.NO_CONTACT].mean())

    @property
    def edges(self) -> Edges:
        """Ice temperatures at the edges of the contact, 3.2.2."""
        return edge_temperatures(self.temperature, self.state != State.NO_CONTACT)

    @property
    def doubts(self) -> list[str]:
        """A warning, without full stop, if the mean friction of (4.7) to (4.9) is implausible."""
        if self.mu_mean <= LARGEST_FRICTION:
            return []
        return [
            f"mu by (4.7) to (4.9) is {self.mu_mean:.4g}: {IN_DOUBT}. The heat through the depth d "
            f"is divided by p V S = {self.power:.3g} W/m2, and a slip that small makes next to none"
        ]


def heat_model(
    footprint: PressureMap,
    parameters: Macroscopic,
    temperature: Array | None = None,
    state: States | None = None,
) -> HeatModel:
    """Modules 2 and 3 below `footprint` (ny, nx).

    temperature: of the ice's surface (K), instead of module 2; state: `State` of every pixel,
    instead of the classification of module 3. Both are (ny, nx), and used in contact only.
    """
    contact, p = footprint.contact, parameters
    flux = friction_flux(p.static_friction, footprint.pressure, p.speed, p.slip)
    if temperature is not None:
        temperature = np.where(contact, temperature, p.ice_temperature)
        rise = temperature - p.ice_temperature
    else:
        if p.source == "moving":
            rise = moving_source_rise(flux, footprint.dx, p.speed, p.effusivity)
        else:
            rise = next_pixel_rise(flux, footprint.dx, p.time, p.ice)
        temperature = p.ice_temperature + rise
    if state is None:
        state = classify(temperature - ZERO_CELSIUS, contact)
    else:
        state = np.where(contact, state, State.NO_CONTACT).astype(np.uint8)
    p_av = footprint.mean_pressure
    mu = friction_map(state, rise, p_av, p)
    balance = heat_balance(state, rise, footprint.pixel_area, p_av, p)
    power, x, pressure = p.power(p_av), footprint.x, footprint.pressure
    return HeatModel(x, pressure, flux, rise, temperature, state, mu, power, balance)


def classify(temperature: Array, contact: Mask) -> States:
    """`State` of every pixel by its temperature (degC).

    (4.8) prints the lower bound of the mixed range as 2 degC; it is -2 degC. 0 degC itself, missing
    in (4.8) and (4.9), is wet.
    """
    state = State.DRY + np.digitize(temperature, [MIXED_FROM, WET_FROM])
    return np.where(contact, state, State.NO_CONTACT).astype(np.uint8)


def friction_map(
    state: States, rise: Array, mean_pressure: float, parameters: Macroscopic
) -> Array:
    """mu = K / d A dT / (p_av V S A_tot) per pixel, (4.7) to (4.9); 0 outside of the contact.

    `rise` dT (K), `mean_pressure` p_av (Pa); K is the conductivity of the tread plus those below it
    (ice; ice and water; water), A the area of all pixels in that state, and A_tot that of the
    contact. The right sides are printed without brackets around their last four factors.
    """
    p, mu = parameters, np.zeros_like(rise)
    ice, water = p.ice.conductivity, p.water_conductivity
    for each, conductivity in zip(STATES, (ice, ice + water, water), strict=True):
        here = state == each
        fraction = np.count_nonzero(here) / np.count_nonzero(state)
        heat = conductivity * rise[here] + p.tread.conductivity * (rise[here] + p.warmer_ice)
        mu[here] = fraction / p.depth * heat / p.power(mean_pressure)
    return mu


def heat_balance(
    state: States, rise: Array, pixel_area: float, mean_pressure: float, parameters: Macroscopic
) -> HeatBalance:
    """Solve (3.8), q_generated = q_ice + q_tread + q_water, for the mean friction mu_av of (3.4).

    q = k / d A dT for ice (3.5) on dry and mixed areas, tread (3.6) on all, water (3.7) on mixed
    and wet ones, with A dT summed over the pixels; `rise` (K), `pixel_area` (m2), `mean_pressure`
    (Pa). (3.8) itself is missing in print. This form follows from the text and from (4.7) to (4.9).
    """
    p = parameters
    dry, mixed, wet = (float(rise[state == each].sum()) * pixel_area / p.depth for each in STATES)
    ice = p.ice.conductivity * (dry + mixed)
    of_tread = float((rise + p.warmer_ice)[state > 0].sum())
    tread = p.tread.conductivity * of_tread * pixel_area / p.depth
    water = p.water_conductivity * (mixed + wet)
    area = pixel_area * np.count_nonzero(state)
    mu = (ice + tread + water) / (p.power(mean_pressure) * area)
    return HeatBalance(ice, tread, water, mu)


def edge_temperatures(temperature: Array, contact: Mask) -> Edges:
    """Means over all touching rows of the first and the last pixel in contact (K).

    The thermal camera of the thesis's source measures there (3.2.2). Ice enters at the right.
    Arrays (ny, nx), or (nx,) of one row.
    """
    temperature, contact = np.atleast_2d(temperature), np.atleast_2d(contact)
    rows = np.flatnonzero(contact.any(axis=1))
    first = contact[rows].argmax(axis=1)
    last = contact.shape[1] - 1 - contact[rows, ::-1].argmax(axis=1)
    return Edges(
        leading=float(temperature[rows, last].mean()),
        trailing=float(temperature[rows, first].mean()),
    )
