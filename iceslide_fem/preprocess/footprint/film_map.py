"""The film law under every pixel, as a map of the footprint: what `passing` lines leave on it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.preprocess.footprint.passing import FilmMap, Path, films_along
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable

# Lines that advance together: their columns of ice stay in the processor's cache.
LINES = 2048
# Error of the ice response with fewer modes, relative to the tolerance.
CONDENSED = 1e-3


def film_map(
    footprint: PressureMap,
    ride: Ride,
    contact_of: ContactTable | ConstantContact,
    tolerance: float = 1e-2,
    ice: Callable[..., Column] = Column,
    tell: Callable[[float], None] = lambda fraction: None,
) -> FilmMap:
    """Film, temperature and friction at every pixel of the footprint.

    contact_of: k, D and H_V over the local pressure; tolerance: target relative error of mu; ice:
    builds columns from a temperature (K), a duration (s) and the ride's solid; tell: called with
    the finished fraction of the pixels in contact. Raises SimulationStopped if a step fails.
    """
    rows, columns = footprint.pressure.shape
    result = FilmMap.untouched((rows, columns), ride)
    passing = footprint.dx / ride.speed
    touching = np.flatnonzero(footprint.contact.any(axis=1))
    pixels = np.count_nonzero(footprint.contact)
    done = 0

    def told(more: int) -> None:
        nonlocal done
        done += more
        tell(done / pixels)

    for first in range(0, touching.size, LINES):
        lines = touching[first : first + LINES]
        path = Path.below(footprint.pressure[lines], passing)
        part = ride.lines(lines)
        below = ice(part.temperature, columns * passing, solid=part.solid)
        below = below.condensed(CONDENSED * tolerance)
        films, warm = films_along(path, part, below, contact_of, tolerance, told)
        _enter(films, warm, result, lines, path, part, below, contact_of)
    return result


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
    content = ice.cooled(warm[:, number], ahead * path.passing)
    result.temperature[here] = ice.take(path.line[before]).surface_temperature(content)
