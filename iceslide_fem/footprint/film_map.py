"""The film law under every pixel: ice points pass below the footprint and carry their films.

An ice point comes in at the leading edge (the last column) with film h0 and cold ice, and sees
the pressure of one pixel after the other, each for dx / V. Lines advance in one call, every line
with steps of its own and at a pixel of its own; film and warmth stay with the ice, also across
gaps.

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
from iceslide_fem.film.point import taken
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
# How closely the ice answers with its modes, relative to the tolerance.
CONDENSED = 1e-3
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

    def lines(self, some: slice) -> FilmMap:
        """The map of `some` of the lines."""
        return FilmMap._make(field[some] for field in self)

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
    mu aimed at; `ice` makes the columns of a temperature (K), a duration (s) and the ride's solid;
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
        done = first * pressure.shape[1]
        for line, column, values in _pass(pressure, passing, part, below, contact_of, tolerance):
            for field, value in zip(result, values, strict=True):
                field[first + line, column] = value
            done += line.size
            tell(done / footprint.pressure.size)
    return result


class _Works(NamedTuple):
    """What adds up below a pixel: mean shear stress (Pa) and energies (J/m2), per line."""

    shear: Array
    friction_work: Array
    ice_heat: Array
    latent_heat: Array


def _pass(
    pressure: Array,
    passing: float,
    ride: Ride,
    ice: Column,
    contact_of: ContactTable | ConstantContact,
    tolerance: float,
) -> Iterator[tuple[Index, Index, FilmMap]]:
    """Lines that have passed a pixel, which that is, and their parts of the map.

    Each line takes equal steps, as long as its last error lets it, that end with the pixel, and
    repeats a step whose estimated error is too large. It does not wait for others.
    """
    lines, columns = pressure.shape
    share = ride.water_share
    least = 0.0 if share > 0.0 else NOTHING
    viscosity, thinning = _water(ride, lines)
    k, D, H_V, _ = contact_of(pressure)
    k, voids = np.where(pressure > 0.0, k, 0.0), np.maximum(share * H_V, least)
    sliding = np.full((lines, 1), ride.sliding_speed)
    of_pixels = film_loads(pressure, sliding, k, D, voids, viscosity[:, None])
    loads = [np.broadcast_to(part, pressure.shape) for part in of_pixels[:4]]
    state = InterfaceState(
        np.full(lines, np.log(ride.initial_height)),
        np.zeros(lines),
        ice.initial(lines),
        INSULATED.initial(lines),
        np.zeros((0 if thinning is None else 1, lines)),
    )
    T_m = ride.solid.melting_temperature
    control, table = StepControl(METHOD, tolerance), thinning and thinning.table
    undercooling = T_m - ice.temperature
    scale = np.broadcast_to(temperature_scale(undercooling, table), (lines,))
    # The lines that have not passed yet, and the pixel that each is at.
    line, column = np.arange(lines), np.full(lines, columns - 1)
    viscous, speed, squeeze, free = (part[line, column] for part in loads)
    load = FilmLoads(viscous, speed, squeeze, free, thinning)
    covered = np.zeros(lines, dtype=bool)
    arrives, left, dt = np.arange(lines), np.full(lines, passing), np.full(lines, passing)
    works = _Works(*np.zeros((4, lines)))
    while line.size:
        if arrives.size:
            pixel = line[arrives], column[arrives]
            for part, everywhere in zip(load[:4], loads, strict=True):
                part[arrives] = everywhere[pixel]
            touches = pressure[pixel] > 0.0
            # At a leading edge voids take in as deep a layer as lies on the ice, of that share.
            enters, covered[arrives] = touches & ~covered[arrives], touches
            layer = np.where(enters, share, 1.0) * state.squeezed_height[arrives]
            state.squeezed_height[arrives] = np.maximum(layer, least)
            left[arrives] = passing
            for work in works:
                work[arrives] = 0.0
        trial = left / np.ceil(left / dt - SLACK)
        step, good, dt = control.trial(state, load, load, trial, ice, scale)
        if (dt[~good] < SHORTEST * passing).any():
            raise SimulationStopped(
                "the film below the footprint cannot be advanced: even steps of "
                f"{dt.min():.1g} s miss the tolerance"
            )
        state = taken(state, step.state, np.flatnonzero(~good))
        left = np.where(good, left - trial, left)
        sheared = trial * load.viscous * step.mean_shearing / passing
        added = sheared, step.friction_work, step.ice_heat, step.latent_heat
        for work, more in zip(works, added, strict=True):
            work += np.where(good, more, 0.0)
        arrives = np.flatnonzero(left <= SLACK * passing)
        if not arrives.size:
            continue
        pixel = line[arrives], column[arrives]
        melting = step.last.melting[arrives]
        squeezed = state.squeezed_height[arrives]
        deep = squeezed / share if share > 0.0 else H_V[pixel]
        warm = ice.surface_temperature(state.ice)[arrives]
        yield (
            *pixel,
            FilmMap(
                shear=works.shear[arrives],
                height=np.exp(state.log_height[arrives]),
                squeezed=np.where(covered[arrives], deep, squeezed),
                temperature=np.where(melting, T_m, warm),  # rounding apart, it has that
                melting=melting,
                saturated=step.last.saturated[arrives],
                friction_work=works.friction_work[arrives],
                ice_heat=works.ice_heat[arrives],
                latent_heat=works.latent_heat[arrives],
            ),
        )
        column[arrives] -= 1
        running = column >= 0
        if not running.all():
            keep = np.flatnonzero(running)
            arrives = np.flatnonzero((left <= SLACK * passing)[keep])
            line, column, left, dt = line[keep], column[keep], left[keep], dt[keep]
            covered, scale, works = covered[keep], scale[keep], _Works(*(w[keep] for w in works))
            state, load, ice = state.take(keep), load.take(keep), ice.take(keep)


def _water(ride: Ride, lines: int) -> tuple[Array, Thinning | None]:
    """Viscosity of every line (Pa s), and how it follows the temperature."""
    given = ride.viscosity
    if not isinstance(given, ViscosityTable):
        return np.full(lines, given), None
    viscosity = np.broadcast_to(given(ride.temperature), (lines,))
    return viscosity, Thinning(given, viscosity)
