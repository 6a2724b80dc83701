"""The film law under every pixel, as a map of the footprint: what `passing` lines leave on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.preprocess.footprint.passing import Films, Path, Ride, films_along
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.materials import ConstantContact, ContactTable

# Lines that advance together: their columns of ice stay in the processor's cache.
LINES = 2048
# How closely the ice answers with its modes, relative to the tolerance.
CONDENSED = 1e-3


class FilmMap(NamedTuple):
    """Film and friction per pixel, arrays (ny, nx).

    shear: mean of tau over the pixel (Pa). When the ice leaves the pixel: height: h (m); squeezed:
    H_s (m); temperature: of the ice surface (K); melting, saturated: which switches are on.
    ice_heat, latent_heat: what ice and melting take, J/m2 per pixel passed.
    """

    shear: Array
    height: Array
    squeezed: Array
    temperature: Array
    melting: Mask
    saturated: Mask
    ice_heat: Array
    latent_heat: Array

    @classmethod
    def untouched(cls, shape: tuple[int, int], ride: Ride) -> FilmMap:
        """The map of ice (ny, nx) that nothing has touched."""
        still = np.zeros((3, *shape))
        never = np.zeros((2, *shape), dtype=bool)
        height, layer = (np.full(shape, h) for h in (ride.initial_height, ride.thinnest_layer))
        temperature = np.broadcast_to(ride.temperature, shape[::-1]).T.copy()
        return cls(still[0], height, layer, temperature, *never, *still[1:])

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
    `tell` is called with the share of the pixels in contact that is done. Raises SimulationStopped
    where a step cannot be made.
    """
    rows, columns = footprint.pressure.shape
    result = FilmMap.untouched((rows, columns), ride)
    temperature, passing = np.broadcast_to(ride.temperature, rows), footprint.dx / ride.speed
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
        part = ride._replace(temperature=temperature[lines])
        below = ice(part.temperature, columns * passing, solid=part.solid)
        below = below.condensed(CONDENSED * tolerance)
        films = films_along(path, part, below, contact_of, tolerance, told)
        _enter(films, result, lines, path, part, below, contact_of)
    return result


def _enter(
    films: Films,
    result: FilmMap,
    lines: Index,
    path: Path,
    ride: Ride,
    ice: Column,
    contact_of: ContactTable | ConstantContact,
) -> None:
    """Films of a path, and what its lines have between their pixels, go into the map's `lines`."""
    here, share = (lines[path.line], path.column), ride.water_share
    height, T_m = np.exp(films.log_height), ride.solid.melting_temperature
    result.shear[here] = films.shear
    result.height[here] = height
    result.squeezed[here] = films.layer / share if share > 0.0 else contact_of(path.pressure).H_V
    # Rounding apart, it has that where it melts.
    result.temperature[here] = np.where(films.melting, T_m, films.temperature)
    result.melting[here], result.saturated[here] = films.melting, films.saturated
    result.ice_heat[here], result.latent_heat[here] = films.ice_heat, films.latent_heat
    ends = np.flatnonzero(path.behind)
    long = path.behind[ends]
    number = np.repeat(np.arange(ends.size), long)  # of the gap, for every pixel in one
    ahead = 1 + np.arange(number.size) - np.repeat(np.cumsum(long) - long, long)
    before = ends[number]
    here = lines[path.line[before]], path.column[before] - ahead
    result.height[here], result.squeezed[here] = height[before], films.layer[before]
    content = ice.cooled(films.content[:, number], ahead * path.passing)
    result.temperature[here] = ice.take(path.line[before]).surface_temperature(content)
