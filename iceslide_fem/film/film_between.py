"""A film between two bodies that conduct heat: ice below it, rubber above it.

A film of height h conducts to either body with G = 2 k_w / h (half of its height to each). At
every contact point, with the film's temperature T_f and the surface temperatures T_i of the ice and
T_r of the rubber (docs/explanation/ice.md):

    T_f    = min(T_m, (q_f + G T_i + G T_r) / (2 G))
    q_ice  = G (T_f - T_i),   q_rubber = G (T_f - T_r)
    q_melt = q_f - q_ice - q_rubber >= 0

In an implicit stage the surface of each body has T = a + R q. Behind half of the film this is T_f =
a + (R + 1/G) q. Both bodies in parallel have the same form, so the film is solved as above ice
alone. G depends on the unknown film height, unless a contact conductance is given.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import WATER_CONDUCTIVITY

# Iterations of film law and conductance stop at this change of ln h. 1/G is a few per cent of the
# bodies' resistances, so the remaining error is a hundredth of it.
HEIGHT_TOLERANCE = 1e-6
MAX_PASSES = 20


class HalfFilm(NamedTuple):
    """Conductance from the middle of a film to each body.

    conductance: given G (W/(m2 K)); if None, G = 2 k_w / h with the conductivity k_w (W/(m K)) of
    `water`.
    """

    conductance: float | None = None
    water: float = WATER_CONDUCTIVITY

    def resistance(self, height: Array) -> Array:
        """1/G (K m2/W) of films of the `height` (m)."""
        if self.conductance is not None:
            return np.full_like(height, 1.0 / self.conductance)
        return np.asarray(height / (2.0 * self.water))


WATER_FILM = HalfFilm()


class RubberSurface(NamedTuple):
    """Thermal response of the rubber in an implicit stage: T_r = offset + resistance * q; arrays.

    offset (K) and resistance (K m2/W) are those of the contact part; cover: contact fraction of the
    film's area, 0 to 1; half_film: conductance between film and bodies.
    """

    offset: Array
    resistance: Array
    cover: Array
    half_film: HalfFilm = WATER_FILM


class Parallel(NamedTuple):
    """Ice and rubber behind half a film each: conductances (W/(m2 K)) and joint response."""

    to_ice: Array
    to_rubber: Array
    surface: Surface


def parallel(ice: Surface, rubber: RubberSurface, height: Array) -> Parallel:
    """Joint response of both bodies to a film of `height` (m), from T and R of `ice`."""
    half = rubber.half_film.resistance(height)
    to_ice = 1.0 / (ice.resistance + half)
    to_rubber = rubber.cover / (rubber.resistance + half)
    both = to_ice + to_rubber
    offset = (to_ice * ice.offset + to_rubber * rubber.offset) / both
    melted_flux = (ice.solid.melting_temperature - offset) * both
    return Parallel(to_ice, to_rubber, Surface(offset, 1.0 / both, melted_flux, ice.solid))


class FilmBetween(NamedTuple):
    """A film between ice and rubber: T_f and both fluxes (see the module docstring)."""

    film: Film
    rubber: RubberSurface

    @property
    def power_at_start(self) -> None:
        """None: the bodies' fractions of the power follow from the stage."""

    @property
    def log_height(self) -> Array:
        """ln h at the start of the stage."""
        return self.film.log_height

    @property
    def dt(self) -> Array | float:
        """Length of the stage, s."""
        return self.film.dt

    def height(self, log_height: Array) -> Array:
        """h (m) from the height variable of the stage."""
        return self.film.height(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """Film and conductance, alternately, from the start height or from ln h = `near`.

        The height is NaN where the iteration does not converge.
        """
        log_height = self.film.log_height if near is None else near
        for _ in range(MAX_PASSES):
            bodies = parallel(ice, self.rubber, self.film.height(log_height))
            result = self.film.solve(bodies.surface)
            change = np.abs(result.log_height - log_height)
            log_height = result.log_height
            if not change.max(initial=0.0) > HEIGHT_TOLERANCE:
                break
        to_ice, to_rubber, (offset, resistance, *_) = bodies
        temperature = offset + resistance * result.ice_flux
        # Without melting, the rubber takes all heat that the ice does not take.
        split = np.where(result.melting, 1.0, to_rubber * resistance)
        return result._replace(
            log_height=np.where(change <= HEIGHT_TOLERANCE, log_height, np.nan),
            ice_flux=to_ice * (temperature - ice.offset),
            rubber_flux=to_rubber * (temperature - self.rubber.offset),
            ice_slope=ice.resistance * to_ice * split,
        )
