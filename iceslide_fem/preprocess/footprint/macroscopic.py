"""The thesis's modules 2 and 3 as one chain, on a line or on a map: heat, dry or wet, friction.

Every module can be entered with data of one's own, as the thesis's flow chart (fig. 2) has it: the
pressure is an argument, a temperature rise and a map of states replace what is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.preprocess.footprint.balance import (
    Conductivities,
    HeatBalance,
    SlidingLine,
    State,
    classify,
    friction_map,
    heat_balance,
)
from iceslide_fem.preprocess.footprint.jaeger import (
    TABLE_1_ICE,
    TABLE_1_RUBBER,
    friction_flux,
    moving_source_rise,
    next_pixel_rise,
)
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.materials import (
    ICE_EFFUSIVITY,
    MELTING_TEMPERATURE,
    WATER_CONDUCTIVITY,
    ZERO_CELSIUS,
    Solid,
)

Source = Literal["next pixel", "moving"]


@dataclass(frozen=True)
class Macroscopic:
    """Every parameter of the macroscopic model; defaults are tables 1 and 2 of the thesis.

    speed V (m/s), slip S and static_friction mu_st: (3.1), (3.2). ice_temperature T_0 (K).
    air_temperature (K): of the air and of the tread before it touches; None: that of the ice, as
    the thesis has it. source: whose heat warms a pixel, that of the next one by (3.3) and (4.1)
    after the time t (s), or that of all it has passed (`moving_source_rise`, which t does not
    enter). depth d (m): of heat penetration, (3.5) to (3.7). ice, tread: thermal properties; ice
    enters (3.3) and (3.5). effusivity (W s^0.5/(m2 K)): of the ice below the moving source.
    water_conductivity: W/(m K).
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
    def conductivities(self) -> Conductivities:
        """k of ice, tread and water, W/(m K)."""
        return Conductivities(
            self.ice.conductivity, self.tread.conductivity, self.water_conductivity
        )

    @property
    def warmer_ice(self) -> float:
        """T_0 less the temperature of the tread (K): what adds to dT in (3.6)."""
        return 0.0 if self.air_temperature is None else self.ice_temperature - self.air_temperature


class HeatModel(NamedTuple):
    """Modules 2 and 3; arrays of the pressure's shape.

    flux: Q of (3.2), W/m2; rise: of the temperature (K); temperature: of the ice's surface (K);
    state: dry, mixed, wet; mu: (4.7) to (4.9); sliding: V and S of the model; balance: (3.4) to
    (3.8).
    """

    flux: Array
    rise: Array
    temperature: Array
    state: NDArray[np.uint8]
    mu: Array
    sliding: SlidingLine
    balance: HeatBalance

    @property
    def edges(self) -> Edges:
        """Temperatures of the ice at the edges of the contact, 3.2.2."""
        return edge_temperatures(self.temperature, self.state != State.NO_CONTACT)


class Edges(NamedTuple):
    """Mean temperature (K) of the ice where it comes in and where it leaves, 3.2.2."""

    leading: float
    trailing: float


def heat_model(
    footprint: PressureMap,
    parameters: Macroscopic,
    temperature: Array | None = None,
    state: NDArray[np.uint8] | None = None,
) -> HeatModel:
    """Modules 2 and 3 below `footprint` (ny, nx); a line is a map with one row.

    temperature: of the ice's surface (K), instead of module 2's; state: `State` of every pixel,
    instead of the classification of module 3. Both are (ny, nx) and count in the contact only.
    """
    contact, p = footprint.contact, parameters
    flux = friction_flux(p.static_friction, footprint.pressure, p.speed, p.slip)
    if temperature is None:
        rise = (
            moving_source_rise(flux, footprint.dx, p.speed, p.effusivity)
            if p.source == "moving"
            else next_pixel_rise(flux, footprint.dx, p.time, p.ice)
        )
        temperature = p.ice_temperature + rise
    else:
        temperature = np.where(contact, temperature, p.ice_temperature)
        rise = temperature - p.ice_temperature
    if state is None:
        state = classify(temperature - ZERO_CELSIUS, contact)
    else:
        state = np.where(contact, state, State.NO_CONTACT).astype(np.uint8)
    sliding = SlidingLine(footprint.mean_pressure, p.speed, p.slip)
    of_tread = rise + p.warmer_ice
    return HeatModel(
        flux,
        rise,
        temperature,
        state,
        friction_map(state, rise, p.depth, sliding, p.conductivities, of_tread),
        sliding,
        heat_balance(
            state, rise, p.depth, footprint.pixel_area, sliding, p.conductivities, of_tread
        ),
    )


def edge_temperatures(temperature: Array, contact: Mask) -> Edges:
    """Means over all rows that touch of the first and the last pixel in contact (K).

    Where the thermal camera of the thesis's source looks (3.2.2): the ice comes in at the right.
    """
    rows = np.flatnonzero(contact.any(axis=1))
    first = contact[rows].argmax(axis=1)
    last = contact.shape[1] - 1 - contact[rows, ::-1].argmax(axis=1)
    return Edges(
        leading=float(temperature[rows, last].mean()),
        trailing=float(temperature[rows, first].mean()),
    )
