"""Heat conduction in the rubber: columns above the points with films (`film_between`).

The warm layer of the rubber, sqrt(alpha t), is 28 um after 7 ms, so one-dimensional columns are
enough.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from typing import Protocol

import numpy as np

from iceslide_fem.film.film_between import WATER_FILM, FilmBetween, HalfFilm, RubberSurface
from iceslide_fem.film.ice_heat import Column, IceHeat
from iceslide_fem.film.law import Film
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import MELTING_TEMPERATURE, Solid

# q_f (W/m2) and h (m) of films, each (n,).
Heating = Callable[[], tuple[Array, Array]]


class RubberHeat(Protocol):
    """Conduction in the rubber as the time integrator sees it; heat state as for `IceHeat`."""

    def initial(self, n_points: int) -> Array:
        """Heat state of rubber at its initial temperature, under `n_points` contact points."""

    def over(self, film: Film, start: Array) -> Film:
        """The film of one implicit stage below this rubber, whose heat state is `start`."""

    def heated(self, start: Array, dt: Array | float, flux: Array) -> Array:
        """Heat state at the end of an implicit stage with `flux` (W/m2) at the films."""

    def surface_temperature(self, heat_state: Array) -> Array:
        """Surface temperature of the rubber at the films (K)."""

    def at_contact(self, heat_state: Array, ice: IceHeat, of_ice: Array) -> Array | None:
        """Rubber temperature at the films (K), above `ice` with heat state `of_ice`; None if
        insulated.
        """

    def film_temperature(self, ice: Array, heat_state: Array, films: Heating) -> Array:
        """T_f (K) of `films` between ice of surface temperature `ice` (K) and this rubber."""

    def take(self, index: Index) -> RubberHeat:
        """The rubber above the points at `index` only."""


class Insulated:
    """Rubber that takes no heat: the default. Heat state: empty, (0, n_points)."""

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
        """A placeholder: insulated rubber has no temperature."""
        return np.zeros(1)

    def at_contact(self, heat_state: Array, ice: IceHeat, of_ice: Array) -> Array | None:
        """None."""
        return None

    def film_temperature(self, ice: Array, heat_state: Array, films: Heating) -> Array:
        """The ice temperature."""
        return ice

    def take(self, index: Index) -> Insulated:
        """The same."""
        return self

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """An empty array for the points."""
        return {"rise": heat_state}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """No heat state."""
        return saved["rise"]

    def covered(self, cover: Array) -> Insulated:
        """The same."""
        return self


INSULATED = Insulated()


class RubberColumns:
    """Columns of rubber above the points with films.

    All points are in contact, unless `covered` says otherwise. Heat state: amplitudes (n_modes,
    n_points) as for `Column`.
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

        half_film: conductance to rubber and ice; melting_temperature: of the ice, K.
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

    def at_contact(self, heat_state: Array, ice: IceHeat, of_ice: Array) -> Array | None:
        """Surface temperature of the rubber, K."""
        return self.surface_temperature(heat_state)

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
        """Checkpoint arrays of a heat state: those of `Column`."""
        return self.column.saved(heat_state)

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays, also those of a shorter run."""
        return self.column.restored(saved)

    def covered(self, cover: Array) -> RubberColumns:
        """The same columns with contact (`cover` 1) or without (0) at each point, (n,)."""
        part = copy(self)
        part._cover = cover
        return part
