"""The film below every pixel of a footprint, also pass after pass over the same ice."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.passes import next_start
from iceslide_fem.preprocess.footprint.passing import FilmMap, Path, films_along
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ahead, Ride
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable

# Lines that advance together: their columns of ice stay in the processor's cache.
LINES = 4096
# Error of the ice response with fewer modes, relative to the tolerance.
CONDENSED = 1e-3


class Lines(NamedTuple):
    """Lines of a footprint: pressure (ny, nx), Pa, and time of the ice per pixel, s, (ny,)."""

    pressure: Array
    passing: Array

    @property
    def contact(self) -> Mask:
        """Pixels in contact, (ny, nx)."""
        return self.pressure > 0.0


class Start(NamedTuple):
    """Lines (ny,) ahead of a pass: their state, and what they bring."""

    state: InterfaceState
    ahead: Ahead


class Passed(NamedTuple):
    """A pass of a footprint: its films, and the state of its lines (ny,) where contact ends."""

    films: FilmMap
    behind: InterfaceState


def film_map(
    footprint: PressureMap,
    ride: Ride,
    contact_of: ContactTable | ConstantContact,
    tolerance: float = 1e-2,
    ice: Callable[..., Column] = Column,
    tell: Callable[[float], None] = lambda fraction: None,
    slides: Mask | None = None,
) -> FilmMap:
    """Film, temperature and friction at every pixel of the footprint, in its last pass.

    contact_of: k, D and H_V over the local pressure; tolerance: target relative error of mu; ice:
    builds columns from a temperature (K), a duration (s), and the ride's solid and ground; tell:
    called with the finished fraction of the pixels in contact, of every pass; slides: where rubber
    slides, (ny, nx), by default everywhere in contact. Raises SimulationStopped if a step fails.
    """
    number, pressure = ride.passes.number, footprint.pressure
    below = Lines(pressure, np.broadcast_to(footprint.dx / ride.speed, (len(pressure),)))

    def told(done: int, part: float) -> None:
        tell((done + part) / number)

    def passed(done: int, start: Start | None) -> Passed:
        settings = contact_of, tolerance, ice, partial(told, done), slides, start
        return one_pass(below, ride, *settings)

    found = passed(0, None)
    for done in range(1, number):
        found = passed(done, start_after(found, below, ride, tolerance, ice))
    return found.films


def one_pass(
    footprint: Lines,
    ride: Ride,
    contact_of: ContactTable | ConstantContact,
    tolerance: float,
    ice: Callable[..., Column] = Column,
    tell: Callable[[float], None] = lambda fraction: None,
    slides: Mask | None = None,
    start: Start | None = None,
) -> Passed:
    """One pass over ice from `start`, by default untouched; the others as for `film_map`."""
    rows, columns = footprint.pressure.shape
    result = FilmMap.untouched((rows, columns), ride.ahead if start is None else start.ahead)
    passing = footprint.passing
    touching = np.flatnonzero(footprint.contact.any(axis=1))
    pixels = np.count_nonzero(footprint.contact)
    every = ride.lines(np.arange(rows))
    below, above = _ice(footprint, every, tolerance, ice), every.rubber(columns * passing)
    begin = every.first_state(below, above) if start is None else start.state
    behind = begin.take(np.arange(rows))
    done = 0

    def told(more: int) -> None:
        nonlocal done
        done += more
        tell(done / pixels)

    for first in range(0, touching.size, LINES):
        lines = touching[first : first + LINES]
        path = Path.below(footprint.pressure[lines], passing[lines])
        part, here = every.lines(lines), below.take(lines)
        moves = np.ones(path.line.size, dtype=bool)
        if slides is not None:
            moves = slides[lines][path.line, path.column]
        bodies = begin.take(lines), here, above.take(lines)
        films, warm, leaving = films_along(path, part, *bodies, contact_of, tolerance, told, moves)
        for whole, values in zip(behind, leaving, strict=True):
            whole[..., lines] = values
        _enter(films, warm, result, lines, path, part, here, contact_of)
    return Passed(result, behind)


def start_after(
    found: Passed,
    footprint: Lines,
    ride: Ride,
    tolerance: float,
    ice: Callable[..., Column] = Column,
) -> Start:
    """Lines ahead of the next pass, after their rest since `found`; the others as of `one_pass`."""
    contact = footprint.contact
    every = ride.lines(np.arange(len(contact)))
    below = _ice(footprint, every, tolerance, ice)
    ends = contact.argmax(axis=1), contact.shape[1] - contact[:, ::-1].argmax(axis=1)
    lasts = np.where(contact.any(axis=1), (ends[1] - ends[0]) * footprint.passing, 0.0)
    state = next_start(found.behind, every, below, ride.passes, every.initial_height, lasts)
    surface = below.surface_temperature(state.ice)
    return Start(state, Ahead(every.film_height(state), state.squeezed_height, surface))


def _ice(footprint: Lines, ride: Ride, tolerance: float, ice: Callable[..., Column]) -> Column:
    """Columns below the lines, with the layers of one pass, and deep enough for all."""
    transit = footprint.pressure.shape[1] * footprint.passing
    shortest, longest = float(transit.min()), float(transit.max())
    if ride.passes.number > 1:
        longest = float(ride.passes.times(longest)[1])
    times = np.array([shortest, longest])
    column = ice(ride.temperature, times, solid=ride.solid, ground=ride.ground)
    return column.condensed(CONDENSED * tolerance, shortest / longest)


def _enter(
    films: FilmMap,
    warm: Array,
    result: FilmMap,
    lines: Index,
    path: Path,
    ride: Ride,
    ice: Column,
    contact_of: ContactTable | ConstantContact,
) -> None:
    """Enter the films of a path, and values in gaps between its pixels, into the map's `lines`."""
    here = lines[path.line], path.column
    fraction = np.broadcast_to(ride.water_fraction, lines.shape)[path.line]
    for whole, values in zip(result, films, strict=True):
        whole[here] = values
    carried = fraction > 0.0
    squeezed = np.where(
        carried, films.squeezed / np.where(carried, fraction, 1.0), contact_of(path.pressure).H_V
    )
    result.squeezed[here] = squeezed
    ends = np.flatnonzero(path.behind)
    long = path.behind[ends]
    number = np.repeat(np.arange(ends.size), long)  # of the gap, for every pixel in one
    ahead = 1 + np.arange(number.size) - np.repeat(np.cumsum(long) - long, long)
    before = ends[number]
    here = lines[path.line[before]], path.column[before] - ahead
    result.height[here], result.squeezed[here] = films.height[before], films.squeezed[before]
    content = ice.cooled(warm[:, number], ahead * path.passing[path.line[before]])
    result.temperature[here] = ice.take(path.line[before]).surface_temperature(content)
