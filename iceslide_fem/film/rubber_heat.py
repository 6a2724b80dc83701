"""Heat conduction in the rubber, and what it makes of the film's energy balance.

A film of height h conducts to either body with G = 2 k_w / h (half of its height to each). At
every contact point, with the film's temperature T_f and the surface temperatures T_i of the ice and
T_r of the rubber (docs/theory.md):

    T_f    = min(T_m, (q_f + G T_i + G T_r) / (2 G))
    q_ice  = G (T_f - T_i),   q_rubber = G (T_f - T_r)
    q_melt = q_f - q_ice - q_rubber >= 0

The warm layer of the rubber, sqrt(alpha t), is 28 um after 7 ms, so one-dimensional columns are
enough. Within an implicit stage each body's surface has T = a + R q, so its answer behind half
of the film is T_f = a + (R + 1/G) q, and both in parallel are again of that form: the film is
solved as if there was ice alone. G follows the film height that is being solved for, unless a
contact conductance is given instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import MELTING_TEMPERATURE, WATER_CONDUCTIVITY, Solid

# Passes over film law and conductance stop when ln h changes by no more than this. 1/G is a few
# per cent of the bodies' resistances, so what is left is a hundredth of it.
HEIGHT_TOLERANCE = 1e-6
MAX_PASSES = 20


# q_f (W/m2) and h (m) of films, (n,) each.
Heating = Callable[[], tuple[Array, Array]]


class RubberHeat(Protocol):
    """Conduction in the rubber as the time integrator sees it; heat state as for `IceHeat`."""

    def initial(self, n_points: int) -> Array:
        """Heat state of rubber at its initial temperature, under `n_points` contact points."""

    def over(self, film: Film, start: Array) -> Film:
        """The film of one implicit stage below this rubber, whose heat state is `start`."""

    def heated(self, start: Array, dt: Array | float, flux: Array) -> Array:
        """Heat state at the end of an implicit stage with `flux` (W/m2) where the films live."""

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature of the rubber's surface where the films live (K)."""

    def film_temperature(self, ice: Array, heat_state: Array, films: Heating) -> Array:
        """T_f (K) of `films` between ice whose surface has `ice` (K) and this rubber."""

    def take(self, index: Index) -> RubberHeat:
        """The rubber above the points at `index` only."""


class Insulated:
    """Rubber that takes no heat: the default. Heat state: nothing, shape (0, n_points)."""

    def initial(self, n_points: int) -> Array:
        """No heat state."""
        return np.zeros((0, n_points))

    def over(self, film: Film, start: Array) -> Film:
        """The film itself."""
        return film

    def heated(self, start: Array, dt: Array | float, flux: Array) -> Array:
        """No heat state."""
        return start

    def surface_temperature(self, heat_state: Array) -> Array:
        """One for all points, of no consequence."""
        return np.zeros(1)

    def film_temperature(self, ice: Array, heat_state: Array, films: Heating) -> Array:
        """That of the ice."""
        return ice

    def take(self, index: Index) -> Insulated:
        """The same."""
        return self

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Nothing, of so many points."""
        return {"rise": heat_state}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """No heat state."""
        return saved["rise"]

    def covered(self, cover: Array) -> Insulated:
        """The same."""
        return self


INSULATED = Insulated()


class HalfFilm(NamedTuple):
    """What conducts from the middle of a film to either body.

    conductance: G (W/(m2 K)) where it is given, else None and G = 2 k_w / h with the `water`'s
    conductivity k_w (W/(m K)).
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
    """The rubber's answer within one implicit stage: T_r = offset + resistance * q; arrays.

    offset (K) and resistance (K m2/W) where there is contact; cover: fraction of the film's area
    that is in contact, 0 to 1; half_film: what conducts between it and the ice.
    """

    offset: Array
    resistance: Array
    cover: Array
    half_film: HalfFilm = WATER_FILM


class RubberColumns:
    """Columns of rubber above the points that carry the films.

    All are in contact, but for what `covered` says. Heat state: amplitudes (n_modes, n_points) as
    for `Column`.
    """

    def __init__(
        self,
        temperature: float | Array,
        duration: float | Array,
        solid: Solid,
        half_film: HalfFilm = WATER_FILM,
        melting_temperature: float = MELTING_TEMPERATURE,
    ) -> None:
        """Rubber `solid` at `temperature` (K) for runs of `duration` (s).

        `half_film` conducts to it and to ice of that `melting_temperature` (K).
        """
        self.column = Column(temperature, duration, solid=solid)
        self._cover: Array = np.ones(1)
        self.half_film, self.melting_temperature = half_film, melting_temperature

    def initial(self, n_points: int) -> Array:
        """Rubber at its initial temperature."""
        return self.column.initial(n_points)

    def over(self, film: Film, start: Array) -> Film:
        """The film between ice and this rubber."""
        return FilmBetween(film, self.response(start, film.dt))

    def response(self, start: Array, dt: Array | float) -> RubberSurface:
        """The rubber's surface at the films at the end of a stage of `dt` (s)."""
        answer = self.column.response(start, dt)
        return RubberSurface(answer.offset, answer.resistance, self._cover, self.half_film)

    def heated(self, start: Array, dt: Array | float, flux: Array) -> Array:
        """Heat state after a stage with `flux` (W/m2) at the points."""
        return self.column.heated(start, dt, dt * flux)

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature at the points (K)."""
        return self.column.surface_temperature(heat_state)

    def film_temperature(self, ice: Array, heat_state: Array, films: Heating) -> Array:
        """T_f = min(T_m, (T_i + T_r + q_f / G) / 2) at the points (K)."""
        power, height = films()
        rise = power * self.half_film.resistance(height)
        free = 0.5 * (ice + self.surface_temperature(heat_state) + rise)
        return np.minimum(self.melting_temperature, free)

    def take(self, index: Index) -> RubberColumns:
        """The columns above the points at `index` only."""
        part = copy(self)
        part.column = self.column.take(index)
        return part

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """What checkpoints keep of a heat state: that of `Column`."""
        return self.column.saved(heat_state)

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state of what was `saved`, also by rubber for shorter runs."""
        return self.column.restored(saved)

    def covered(self, cover: Array) -> RubberColumns:
        """The same columns where points have contact (`cover` 1) or none (0), shape (n,)."""
        part = copy(self)
        part._cover = cover
        return part


class Parallel(NamedTuple):
    """Ice and rubber, each behind half of a film: conductances (W/(m2 K)) and joint answer."""

    to_ice: Array
    to_rubber: Array
    surface: Surface


def parallel(ice: Surface, rubber: RubberSurface, height: Array) -> Parallel:
    """What both bodies answer together to a film of a `height` (m); only T and R of `ice` count."""
    half = rubber.half_film.resistance(height)
    to_ice = 1.0 / (ice.resistance + half)
    to_rubber = rubber.cover / (rubber.resistance + half)
    both = to_ice + to_rubber
    offset = (to_ice * ice.offset + to_rubber * rubber.offset) / both
    melted_flux = (ice.solid.melting_temperature - offset) * both
    return Parallel(to_ice, to_rubber, Surface(offset, 1.0 / both, melted_flux, ice.solid))


class FilmBetween(NamedTuple):
    """A film between ice and rubber: T_f and both fluxes (see the module's head)."""

    film: Film
    rubber: RubberSurface

    @property
    def power_at_start(self) -> None:
        """None: how the bodies share it follows from the stage."""

    @property
    def log_height(self) -> Array:
        """ln h at the start of the stage."""
        return self.film.log_height

    @property
    def dt(self) -> Array | float:
        """Length of the stage, s."""
        return self.film.dt

    def height(self, log_height: Array) -> Array:
        """h (m) of what the stage says."""
        return self.film.height(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """Film and conductance in turn, from the stage's own height or `near` another ln h.

        The height is NaN where they do not settle.
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
        # Where the film does not melt, what the ice does not take the rubber does.
        split = np.where(result.melting, 1.0, to_rubber * resistance)
        return result._replace(
            log_height=np.where(change <= HEIGHT_TOLERANCE, log_height, np.nan),
            ice_flux=to_ice * (temperature - ice.offset),
            rubber_flux=to_rubber * (temperature - self.rubber.offset),
            ice_slope=ice.resistance * to_ice * split,
        )
