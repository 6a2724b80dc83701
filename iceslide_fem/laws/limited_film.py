"""The film law with a limiting shear stress, that of dry rubber on ice.

The equations are those of `film.limiting_shear`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.limiting_shear import SHEAR_STRENGTH, SLOWEST, LimitingShear
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.shear_strength import ShearStrength, shearing_height
from iceslide_fem.laws.film import FilmLaw, default_ramp, film_law
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedFilm(FilmLaw):
    """The film law with a `limit`.

    Initial values: tau_b `first_strength` (Pa), film height `first_height` (m), slip speed
    `first_speed` (m/s). The ice melts at `melting_temperature` (K).
    """

    limit: LimitingShear
    first_strength: float
    first_speed: float
    first_height: float
    melting_temperature: float
    name: ClassVar[str] = "film with a limiting shear stress"
    viscous: ClassVar[bool] = False

    @property
    def freezes(self) -> bool:
        """Whether the scene has freezing films."""
        return self.limit.freezes

    @property
    def columns(self) -> tuple[str, ...]:
        """tau_b."""
        return (SHEAR_STRENGTH,)

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial values as of `LimitingShear.internal`."""
        first, strength = self.initial(self.first_height, 1)[2][:, 0]
        return float(first), float(strength)

    def loads(self, pressure: Array, speed: Array) -> FilmLoads:
        """Loads of the film at local `pressure` (Pa) and `speed` (m/s)."""
        return super().loads(pressure, speed)._replace(limit=self.limit)

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """Films of the height (m) without squeezed-out water, on ice at its initial temperature."""
        height = np.full(n, film_height)
        strength, speed = np.full(n, self.first_strength), np.full(n, self.first_speed)
        internal = self.limit.internal(height, speed, strength)
        return self.limit.log_height(height), np.zeros(n), internal

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln(h + s) and internal variables, with tau_b at the temperature (K)."""
        strength = self.limit.strength(np.maximum(self.melting_temperature - temperature, 0.0))
        speed = np.full_like(height, self.first_speed)
        return self.limit.log_height(height), self.limit.internal(height, speed, strength)

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of films in `state`, with their present strength."""
        return self.limited(self.limit.height(state.log_height), state.internal[1])

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """`state` with the shearing of its films at the slip `speed` (m/s)."""
        height, strength = self.limit.height(state.log_height), state.internal[1]
        internal = self.limit.internal(height, np.full_like(height, speed), strength)
        return state._replace(internal=internal)

    def at_start(self, film_height: float, n: int) -> Sheared:
        """Shear of `n` films of the height (m)."""
        return self.limited(np.full(n, film_height), np.full(n, self.first_strength))

    def film_height(self, state: InterfaceState) -> Array:
        """h of every film (n,), m."""
        return self.limit.height(state.log_height)

    def height_at(self, state: InterfaceState, read: Callable[[Array], Array]) -> Array:
        """Mean h (m) of the films around points."""
        return read(self.film_height(state))

    def reported(self, internal: Array, pressure: Array) -> Mapping[str, Array]:
        """tau_b (Pa)."""
        return {SHEAR_STRENGTH: internal[1]}

    def read(self, shearing: Array, internal: Array, speed: Array) -> Sheared:
        """The shear law of points with the mean `shearing` 1 / (h + h_b) (1/m), (n,)."""
        whole, drag = 1.0 / shearing, self.limit.drag(speed)
        dry = np.minimum(drag / internal[1], whole)
        return self.limited(whole - dry, drag / dry)

    def limited(self, height: Array, strength: Array) -> Sheared:
        """Shear of films of the height (m) and strength (Pa), (n,)."""

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            h, tau_b = (part.reshape(pressure.shape) for part in (height, strength))
            whole = h + self.limit.drag(speed) / tau_b
            unit, slope = self.shear(pressure, np.ones_like(whole), whole)
            by_speed = unit * np.where(np.abs(speed) > SLOWEST, h / whole, 1.0)
            return unit * speed, slope * speed, by_speed

        return shear


def limited_film(scene: Scene, strength: ShearStrength) -> LimitedFilm:
    """The film law of the scene, limited by tau_b from `strength`."""
    film, speeds = film_law(scene), scene.load.speeds
    limit = LimitingShear.of(strength, film.viscosity, speeds.largest, scene.film.refreeze)
    coldest = np.array([scene.ice.melting_temperature - scene.ice.temperature])
    first = strength(coldest)
    height = shearing_height(scene, speeds.largest)
    ramp = scene.numerics.shear_ramp_pressure or default_ramp(scene, height)
    return LimitedFilm(
        **vars(film) | {"ramp_pressure": ramp},
        limit=limit,
        first_strength=float(first[0]),
        first_speed=speeds.first,
        first_height=scene.initial_height,
        melting_temperature=scene.ice.melting_temperature,
    )
