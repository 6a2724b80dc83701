"""Heat conduction in the rubber: columns above the points with films (`film_between`).

The warm layer of the rubber, sqrt(alpha t), is 28 um after 7 ms, so one-dimensional columns are
enough.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.ice_heat import Column, IceHeat
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import MELTING_TEMPERATURE, WATER_CONDUCTIVITY, Solid

# Iterations of film law and conductance stop at this change of ln h. 1/G is a few per cent of the
# bodies' resistances, so the remaining error is a hundredth of it.
HEIGHT_TOLERANCE = 1e-6
MAX_PASSES = 20
# m, of films that conduct. Bodies of unlike temperature that meet without resistance have an
# infinite flux at first, which no step resolves.
THINNEST = 1e-9


class HalfFilm(NamedTuple):
    """Conductance from the middle of a film to each body.

    conductance: given G (W/(m2 K)); if None, G = 2 k_w / h with the conductivity k_w (W/(m K)) of
    `water`, and h of at least 1 nm.
    """

    conductance: float | None = None
    water: float = WATER_CONDUCTIVITY

    def resistance(self, height: Array) -> Array:
        """1/G (K m2/W) of films of the `height` (m)."""
        if self.conductance is not None:
            return np.full_like(height, 1.0 / self.conductance)
        return np.maximum(height, THINNEST) / (2.0 * self.water)


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
    T_m = ice.solid.melting_temperature
    into_rubber = to_rubber * (T_m - rubber.offset)
    surface = Surface(offset, 1.0 / both, (T_m - offset) * both, ice.solid, into_rubber)
    return Parallel(to_ice, to_rubber, surface)


class FilmBetween(NamedTuple):
    """A film between ice and rubber: T_f and both fluxes (see the module docstring)."""

    film: Film
    rubber: RubberSurface

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
        """Surface temperature (K) at the rubber's points, above `ice` with heat state `of_ice`;
        None if insulated.
        """

    def film_temperature(self, ice: Array, heat_state: Array, films: Heating) -> Array:
        """T_f (K) of `films` between ice of surface temperature `ice` (K) and this rubber."""

    def cooled(self, heat_state: Array, time: float | Array) -> Array:
        """Heat state after a `time` (s) without contact, in which no air takes heat."""

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

    def cooled(self, heat_state: Array, time: float | Array) -> Array:
        """No heat state."""
        return heat_state

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
        """Surface temperature of the rubber at its points, K."""
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
        """Checkpoint arrays of a heat state: those of `Column`."""
        return self.column.saved(heat_state)

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays, also those of a shorter run."""
        return self.column.restored(saved)

    def cooled(self, heat_state: Array, time: float | Array) -> Array:
        """Heat state after a `time` (s) without contact, in which no air takes heat."""
        rest = np.broadcast_to(np.asarray(time, dtype=float), heat_state.shape[-1:])
        return self.column.cooled(heat_state, rest)

    def covered(self, cover: Array) -> RubberColumns:
        """The same columns with contact (`cover` 1) or without (0) at each point, (n,)."""
        part = copy(self)
        part._cover = cover
        return part
