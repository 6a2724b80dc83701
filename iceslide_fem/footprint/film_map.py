"""The film law under every pixel: ice points pass below the footprint and carry their films.

An ice point comes in at the leading edge (the last column) with film h0 and cold ice, and sees
the pressure of one pixel after the other, each for dx / V. All lines advance together, every line
with steps of its own; film and warmth stay with the ice, also across gaps.

Squeezed-out water moves at a share of the ice's speed (`Ride.water_share`; `interface.water` for a
block that slides). Where it is steady its flux is the same: below the rubber it is deeper than
the layer that the ice alone would carry. So what a line carries along is that layer, w H_s / V,
and the layer that voids of H_V can pass on is the same share of H_V.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array, Index, Mask
from iceslide_fem.errors import SimulationStopped
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import INTEGRATORS, InterfaceState
from iceslide_fem.film.law import FilmLoads, film_loads
from iceslide_fem.film.point import CONDENSED
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.film.step_control import StepControl
from iceslide_fem.film.viscosity import Thinning, temperature_scale
from iceslide_fem.footprint.pressure_map import PressureMap
from iceslide_fem.materials import (
    ICE,
    WATER_VISCOSITY,
    ConstantContact,
    ContactTable,
    Solid,
    ViscosityTable,
)

METHOD = INTEGRATORS["sdirk2"]
# Lines that advance together: their columns of ice stay in the processor's cache.
LINES = 2048
# Relative to a pixel's time: the shortest step, and what is left over to rounding.
SHORTEST, SLACK = 1e-9, 1e-6
NOTHING = 1e-15  # m, that voids can pass on whose water stays where it is: they are full


class Ride(NamedTuple):
    """How ice passes the footprint: V and the sliding speed V S (m/s), T_0 (K), h0 (m).

    T_0 may be an array (ny,), one temperature for each line. water_speed: of squeezed-out water
    relative to the rubber, a share of the sliding speed. Tables of the viscosity are read at
    the film's temperature.
    """

    speed: float
    sliding_speed: float
    temperature: float | Array
    initial_height: float = 70e-9
    solid: Solid = ICE
    viscosity: float | ViscosityTable = WATER_VISCOSITY
    water_speed: float = 1.0

    @property
    def water_share(self) -> float:
        """w / V of the water below the rubber, which itself passes the footprint at V (1 - S)."""
        return 1.0 - self.sliding_speed / self.speed * (1.0 - self.water_speed)


class FilmMap(NamedTuple):
    """Film and friction per pixel, arrays (ny, nx).

    shear: mean of tau over the pixel (Pa). When the ice leaves the pixel: height: h (m); squeezed:
    H_s (m); temperature: of the ice surface (K); melting, saturated: which switches are on.
    friction_work, ice_heat, latent_heat: J/m2 per pixel passed.
    """

    shear: Array
    height: Array
    squeezed: Array
    temperature: Array
    melting: Mask
    saturated: Mask
    friction_work: Array
    ice_heat: Array
    latent_heat: Array

    @classmethod
    def empty(cls, shape: tuple[int, ...]) -> FilmMap:
        """Room for a map of that shape."""
        switches = ("melting", "saturated")
        return cls(*(np.zeros(shape, dtype=bool if f in switches else float) for f in cls._fields))

    def friction(self, footprint: PressureMap) -> Array:
        """mu per pixel, tau / p (5.30); 0 where there is no contact."""
        pressure = footprint.pressure
        return np.divide(self.shear, pressure, out=np.zeros_like(pressure), where=pressure > 0.0)

    def mean_friction(self, footprint: PressureMap) -> float:
        """Friction force over load of the whole footprint."""
        return float(self.shear.sum() / footprint.pressure.sum())


def film_map(
    footprint: PressureMap,
    ride: Ride,
    contact_of: ContactTable | ConstantContact,
    tolerance: float = 1e-2,
    ice: Callable[..., Column] = Column,
    tell: Callable[[float], None] = lambda share: None,
) -> FilmMap:
    """Film, temperature and friction at every pixel of the footprint.

    `contact_of` gives k, D and H_V of the local pressure; `tolerance` is the relative error of
    mu aimed at; `ice` makes the columns of a temperature (K), a duration (s) and the ride's
    solid;
    `tell` is called with the share of the pixels that is done. Raises SimulationStopped where a
    step cannot be made.
    """
    result = FilmMap.empty(footprint.pressure.shape)
    temperature = np.broadcast_to(ride.temperature, len(footprint.pressure))
    for first in range(0, len(footprint.pressure), LINES):
        lines = slice(first, first + LINES)
        pressure, part = footprint.pressure[lines], ride._replace(temperature=temperature[lines])
        passing = footprint.dx / ride.speed
        duration = footprint.pressure.shape[1] * passing
        below = ice(part.temperature, duration, solid=part.solid).condensed(CONDENSED * tolerance)
        for column, values in _pass(pressure, passing, part, below, contact_of, tolerance):
            for field, value in zip(result, values, strict=True):
                field[lines, column] = value
            in_part = (pressure.shape[1] - column) * len(pressure)
            tell((first * pressure.shape[1] + in_part) / footprint.pressure.size)
    return result


def _pass(
    pressure: Array,
    passing: float,
    ride: Ride,
    ice: Column,
    contact_of: ContactTable | ConstantContact,
    tolerance: float,
) -> Iterator[tuple[int, FilmMap]]:
    """Columns of pixels from the leading to the trailing edge, with their part of the map."""
    lines, columns = pressure.shape
    height, sliding = np.full(lines, ride.initial_height), np.full(lines, ride.sliding_speed)
    given, thinning = ride.viscosity, None
    if isinstance(given, ViscosityTable):
        viscosity = np.broadcast_to(given(ride.temperature), (lines,))
        thinning = Thinning(given, viscosity)
    else:
        viscosity = np.full(lines, given)
    state = InterfaceState(
        np.log(height),
        np.zeros(lines),
        ice.initial(lines),
        INSULATED.initial(lines),
        np.zeros((0 if thinning is None else 1, lines)),
    )
    dt = np.full(lines, passing)
    share, covered = ride.water_share, np.zeros(lines, dtype=bool)
    least = 0.0 if share > 0.0 else NOTHING
    for column in range(columns - 1, -1, -1):
        p = np.ascontiguousarray(pressure[:, column])
        k, D, H_V, _ = contact_of(p)
        voids = np.maximum(share * H_V, least)
        k = np.where(p > 0.0, k, 0.0)
        loads = film_loads(p, sliding, k, D, voids, viscosity, thinning)
        # At a leading edge voids take in as deep a layer as lies on the ice, of that share.
        enters, covered = ~covered & (p > 0.0), p > 0.0
        layer = np.where(enters, share, 1.0) * state.squeezed_height
        state = state._replace(squeezed_height=np.maximum(layer, least))
        state, dt, values = _cross(state, dt, loads, passing, ice, tolerance)
        deep = values.squeezed / share if share > 0.0 else H_V
        yield column, values._replace(squeezed=np.where(covered, deep, values.squeezed))


def _cross(
    state: InterfaceState,
    dt: Array,
    loads: FilmLoads,
    passing: float,
    ice: Column,
    tolerance: float,
) -> tuple[InterfaceState, Array, FilmMap]:
    """Advance all lines across one pixel: new state, steps for the next pixel, the pixel's map.

    Each line takes equal steps, no longer than its `dt` (s), that end with the pixel, and repeats
    a step whose estimated error is too large.
    """
    state, dt = InterfaceState(*(part.copy() for part in state)), dt.copy()
    left = np.full_like(dt, passing)
    result = FilmMap.empty(dt.shape)
    here = np.arange(dt.size)
    control = StepControl(METHOD, tolerance)
    while here.size:
        start, load = _at(state, here), loads.take(here)
        trial = left[here] / np.ceil(left[here] / dt[here] - SLACK)
        below = ice.take(here)
        undercooling = below.solid.melting_temperature - below.temperature
        scale = temperature_scale(undercooling, loads.thinning and loads.thinning.table)
        step, good, wanted = control.trial(start, load, load, trial, below, scale)
        dt[here] = wanted
        if (wanted[~good] < SHORTEST * passing).any():
            raise SimulationStopped(
                "the film below the footprint cannot be advanced: even steps of "
                f"{wanted.min():.1g} s miss the tolerance"
            )
        done = here[good]
        for whole, new in zip(state, step.state, strict=True):
            whole[..., done] = new[..., good]
        left[done] -= trial[good]
        result.shear[done] += (trial * load.viscous * step.mean_shearing)[good] / passing
        for name in ("friction_work", "ice_heat", "latent_heat"):
            getattr(result, name)[done] += getattr(step, name)[good]
        result.melting[done] = step.last.melting[good]
        result.saturated[done] = step.last.saturated[good]
        here = here[left[here] > SLACK * passing]
    result.height[:], result.squeezed[:] = np.exp(state.log_height), state.squeezed_height
    result.temperature[:] = ice.surface_temperature(state.ice)
    # rounding apart, it has that
    result.temperature[result.melting] = ice.solid.melting_temperature
    return state, dt, result


def _at(state: InterfaceState, index: Index) -> InterfaceState:
    return InterfaceState(*(part[..., index] for part in state))
