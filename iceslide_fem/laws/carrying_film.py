"""The film law beside voids whose water bears a part of the pressure (`film.voids`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from iceslide_fem.film.carrying import CarryingLoads
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.voids import Lugs, Voids, lugs_of
from iceslide_fem.laws.film import FilmLaw
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene import Scene
from iceslide_fem.scene.contact_table import ContactTable


@dataclass(frozen=True, eq=False)
class CarryingFilm:
    """A `film` law of constant viscosity, its `voids`, and the `lugs` that drain water.

    Internal variables are ln(eta / eta_0) = 0, and the length B of the lug above (m), initially of
    the longest lug. brought: function from positions x (m) to the water height on the ice (m).
    """

    film: FilmLaw
    voids: Voids
    lugs: Lugs
    brought: Callable[[Array], Array]
    name: ClassVar[str] = "film beside voids that carry"
    has_film: ClassVar[bool] = False
    viscous: ClassVar[bool] = True
    freezes: ClassVar[bool] = False
    fault: ClassVar[str | None] = None
    columns: ClassVar[tuple[str, ...]] = ()

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial values: films below the longest lug."""
        return 0.0, self.lugs.longest

    def frame(self, asked: str) -> str:
        """The frame that the scene has `asked` for."""
        return asked

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """Films of the height (m), and voids with the water on the ice."""
        return np.full(n, np.log(film_height)), self.brought(np.zeros(n)), self._below(n)

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h of films of the height (m)."""
        return np.log(height), self._below(height.size)

    def loads(self, pressure: Array, speed: Array) -> CarryingLoads:
        """Loads at local `pressure` (Pa) and `speed` (m/s)."""
        fade, _ = self.film.ramp(pressure)
        touching = self.film.loads(pressure, speed)
        return CarryingLoads(self.voids, touching, pressure, fade, self.film.viscosity)

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of films in `state`, beside voids with their present water."""
        return self.over(np.exp(state.log_height), state.squeezed_height)

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """The state, as of `FilmLaw`."""
        return state

    def at_start(self, film_height: float, n: int) -> Sheared:
        """The shear law of `n` films of the height (m)."""
        return self.over(np.full(n, film_height), self.brought(np.zeros(n)))

    def film_height(self, state: InterfaceState) -> Array:
        """h of every film (n,), m."""
        return np.asarray(np.exp(state.log_height))

    def height_at(self, state: InterfaceState, read: Callable[[Array], Array]) -> Array:
        """As of `FilmLaw`."""
        return self.film.height_at(state, read)

    def read(self, shearing: Array, internal: Array, speed: Array) -> Sheared:
        """As of `FilmLaw`, with all pressure on the asperities."""
        return self.film.read(shearing, internal, speed)

    def over(self, film_height: Array, water: Array) -> Sheared:
        """The shear law of films of these heights beside voids with this water (m), (n,)."""

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            height, full = (part.reshape(pressure.shape) for part in (film_height, water))
            unit = self._unit(pressure, height, full)
            step = 1e-6 * np.maximum(np.abs(pressure), 1.0)
            by_pressure = (self._unit(pressure + step, height, full) - unit) / step
            return unit * speed, by_pressure * speed, unit

        return shear

    def reported(self, internal: Array, pressure: Array) -> Mapping[str, Array]:
        """No columns: no internal variable is reported."""
        return {}

    def outside(self, pressure: Array) -> Mask:
        """Mask of pressures outside the table of k, D, H_V."""
        return self.film.outside(pressure)

    def _below(self, n: int) -> Array:
        """Internal variables of `n` films."""
        return np.tile(np.array(self.internal_at_start)[:, None], n)

    def _unit(self, pressure: Array, height: Array, water: Array) -> Array:
        """tau over the slip speed (Pa s/m)."""
        return self.loads(pressure, np.ones_like(pressure)).tau(height, water)


def carrying_film(film: FilmLaw, scene: Scene) -> CarryingFilm:
    """The scene's `film` law beside voids that carry."""
    table = film.parameters
    assert isinstance(table, ContactTable)  # by the scene's validation
    lugs = lugs_of(scene.rubber, wide=scene.model != "block")
    return CarryingFilm(film, Voids(table, lugs.longest), lugs, scene.ice.water_at)
