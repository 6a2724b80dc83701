"""The film law under contact with age-dependent k, D and H_V (`film.contact_age`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from iceslide_fem.film.aged_loads import AgedLoads
from iceslide_fem.film.contact_age import CONTACT_AREA, ContactAge
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.laws.film import FilmLaw
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.runtime.arrays import Array, Mask


@dataclass(frozen=True, eq=False)
class AgedFilm:
    """A `film` law for fresh contact, and the ageing of the contact.

    Internal variables are those of the film (ln(eta / eta_0) = 0 if it has none), then the
    contact's history. temperature: of insulated rubber, K.
    """

    film: FilmLaw
    age: ContactAge
    temperature: float
    has_film: ClassVar[bool] = True
    fault: ClassVar[str | None] = None

    @property
    def name(self) -> str:
        """Name of the film law, with the contact's age."""
        return f"{self.film.name} at the contact's age"

    @property
    def viscous(self) -> bool:
        """As of the film."""
        return self.film.viscous

    @property
    def freezes(self) -> bool:
        """As of the film."""
        return self.film.freezes

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the film, and k."""
        return *self.film.columns, CONTACT_AREA

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial values of the film, and the history of an untouched contact."""
        return *(self.film.internal_at_start or (0.0,)), *(0.0,) * self.age.rows

    def frame(self, asked: str) -> str:
        """The frame that the scene has `asked` for."""
        return self.film.frame(asked)

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """Initial films under untouched contact."""
        log_height, squeezed, internal = self.film.initial(film_height, n)
        return log_height, squeezed, self._below_fresh(internal, n)

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """Films under untouched contact."""
        log_height, internal = self.film.films(height, temperature)
        return log_height, self._below_fresh(internal, height.size)

    def loads(self, pressure: Array, speed: Array) -> AgedLoads:
        """Loads of the film at local `pressure` (Pa) and `speed` (m/s)."""
        acting = np.where(pressure > 0.0, self.film.read_at(pressure), 0.0)
        touching = self.film.loads(pressure, speed)
        return AgedLoads(self.age, self.temperature, touching, acting, acting)

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of films in `state`; k follows the pressure instantly."""
        contact = self.age.so_far(state.internal[-self.age.rows :])
        return replace(self.film, parameters=contact).sheared(state, temperature)

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """As of the film, with the contact's history."""
        of_film, history = np.split(state.internal, [-self.age.rows])
        film = self.film.at_speed(state._replace(internal=of_film), speed)
        return film._replace(internal=np.concatenate([film.internal, history]))

    def at_start(self, film_height: float, n: int) -> Sheared:
        """The shear law of `n` films of the height (m) under fresh contact."""
        return self.film.at_start(film_height, n)

    def film_height(self, state: InterfaceState) -> Array:
        """h of every film (n,), m."""
        return self.film.film_height(state)

    def height_at(self, state: InterfaceState, read: Callable[[Array], Array]) -> Array:
        """As of `FilmLaw`."""
        return self.film.height_at(state, read)

    def read(self, shearing: Array, internal: Array, speed: Array) -> Sheared:
        """As of `FilmLaw`, under fresh contact."""
        return self.film.read(shearing, internal, speed)

    def reported(self, internal: Array, pressure: Array) -> Mapping[str, Array]:
        """Values of the film, and k for this history under `pressure` (Pa), (n,)."""
        of_film = internal[: len(self.film.internal_at_start)]
        contact = self.age.so_far(internal[-self.age.rows :])
        k, _ = contact.contact_area(self.film.read_at(pressure))
        return {**self.film.reported(of_film, pressure), CONTACT_AREA: k}

    def outside(self, pressure: Array) -> Mask:
        """Mask of pressures outside the table of k, D, H_V for fresh contact."""
        return self.film.outside(pressure)

    def _below_fresh(self, internal: Array, n: int) -> Array:
        """Internal variables of `n` films under untouched contact."""
        of_film = internal if len(internal) else np.zeros((1, n))
        return np.concatenate([of_film, self.age.fresh(n)])
