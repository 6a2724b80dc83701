"""A law of the scene's own between rubber and ice: its steps, its errors, its shear.

What a law of `laws.protocol` leaves to the program: heat goes into ice and rubber, ice melts
where it would get warmer than that, and steps of implicit Euler become Runge-Kutta steps.
Beside a law there is no water film; the names of the film stay empty.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.errors import SceneError
from iceslide_fem.film.friction import Sheared
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Step, surface_errors
from iceslide_fem.film.law import Film, FilmStage, Remembered, Surface
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.weakening import check_weakening
from iceslide_fem.laws import protocol
from iceslide_fem.laws.bound import Answer, BoundLaw
from iceslide_fem.laws.load import coulomb, own_law
from iceslide_fem.scene import Scene

# Rubber and ice touch: a layer of water that hardly resists heat (m).
NO_FILM = 1e-9
WARMER = 1e-4  # K, by which the fall of the heat with temperature is found


def law_of(scene: Scene) -> BoundLaw | None:
    """The scene's own law, or None with the film's. Runs a law's file; raises SceneError."""
    law = _made(scene)
    if law is not None:
        check_weakening(scene, law)
    return law


def _made(scene: Scene) -> BoundLaw | None:
    friction = scene.friction
    if friction.law == "film":
        return None
    melting_temperature = scene.ice.melting_temperature
    if friction.law == "coulomb":
        return coulomb(friction.mu, friction.table, melting_temperature)
    law = own_law(*friction.law_file, friction.parameters, melting_temperature)
    passes = scene.model == "point" and scene.ice.motion == "sliding"
    if passes and law.fields and law.carried_by(scene.film.carrier) == "rubber":
        raise SceneError(
            f'the friction law {law.name} has carrier = "rubber", which contradicts model = '
            '"point" where ice slides: what it remembers is older than the ice below; allowed: '
            'model = "slice" or "block", or ice.motion = "attached"'
        )
    return law


class Places(Protocol):
    """Places that remember, where they are not the points themselves."""

    def at_points(self, memory: Array) -> Array:
        """Memory (m, n) at the points of that at the places. Collective."""

    def changed(self, memory: Array, by: Array) -> Array:
        """Memory of the places after points have changed theirs `by` (m, n). Collective."""


class OwnLoads(NamedTuple):
    """What acts under the law at each point: pressure (Pa) and slip speed (m/s).

    places: what remembers, if it is not the points.
    """

    law: BoundLaw
    pressure: Array
    speed: Array
    places: Places | None = None

    def at(self, end: Self, fraction: float) -> OwnLoads:
        """Loads at `fraction` of a step that ends with `end`."""
        pressure, speed = (a + fraction * (b - a) for a, b in zip(self[1:3], end[1:3], strict=True))
        return OwnLoads(self.law, pressure, speed, self.places)

    def memory(self, memory: Array) -> Array:
        """Of the points, (m, n). Collective."""
        return memory if self.places is None else self.places.at_points(memory)

    def remembered(self, before: Array, stage: FilmStage) -> Array:
        """Memory of the places after the `stage`, of which it was `before` at its start."""
        if self.places is None:
            return stage.memory
        return self.places.changed(before, stage.memory - self.places.at_points(before))

    def film(
        self,
        start: Remembered,
        before: Remembered,
        dt: Array | float,
        stage: Callable[..., FilmStage],
    ) -> Film:
        """The law in a stage of `dt` (s) from `start`; always implicit."""
        memory = self.memory(start.memory)
        return OwnFilm(start.log_height, start.squeezed_height, memory, dt, self)


class OwnFilm(NamedTuple):
    """A law in one implicit stage, as the bodies below and above see it."""

    log_height: Array
    squeezed_height: Array
    memory: Array
    dt: Array | float
    loads: OwnLoads

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """What the law makes of the ice's answer; what would warm it above T_m melts it.

        The heat falls with the ice's temperature as the law lets it where the ice does not melt,
        and by what holds the ice at T_m where it does: across that corner there is no slope.
        """
        answer = self._response(ice)
        colder = ice.melted_flux - WARMER / ice.resistance
        warmer = self._response(ice._replace(offset=ice.offset + WARMER, melted_flux=colder))
        melting = answer.heat > ice.melted_flux
        fall = np.clip(ice.resistance * (answer.heat - warmer.heat) / WARMER, 0.0, 1.0)
        q_ice = np.minimum(answer.heat, ice.melted_flux)
        return FilmStage(
            self.log_height,
            self.squeezed_height,
            answer.heat,
            q_ice,
            answer.heat - q_ice,
            ice.offset + ice.resistance * answer.heat,
            melting,
            np.zeros_like(melting),
            np.full_like(q_ice, -1.0),
            np.where(melting, 1.0, fall),
            np.zeros_like(q_ice),
            answer.memory,
        )

    def _response(self, ice: Surface) -> Answer:
        T_m = ice.solid.melting_temperature
        surface = protocol.Surface(ice.offset, ice.resistance, T_m, ice.melted_flux)
        loads = self.loads
        return loads.law.respond(loads.pressure, loads.speed, self.memory, surface, self.dt)


class OwnFriction:
    """The shear of a law, as carriers and block ask for it (`film.friction.Friction`)."""

    def __init__(self, law: BoundLaw, temperature: float) -> None:
        """`temperature` (K) is that of the ice at the start."""
        self.law, self._cold = law, temperature

    is_own = True

    @property
    def fault(self) -> str | None:
        """What the law has done wrong."""
        return self.law.fault

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """No film, nothing squeezed out, and the law's memory of `n` points."""
        return np.full(n, np.log(NO_FILM)), np.zeros(n), self.law.initial(n)

    def loads(self, pressure: Array, speed: Array) -> OwnLoads:
        """Loads at local `pressure` (Pa) and `speed` (m/s)."""
        return OwnLoads(self.law, np.maximum(pressure, 0.0), speed)

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """Shear of the law in `state` on ice of that temperature (K)."""
        return self._over(state.memory, temperature())

    def at_start(self, film_height: float, n: int) -> Sheared:
        """Shear of `n` points before anything has happened."""
        return self._over(self.law.initial(n), np.full(n, self._cold))

    def outside(self, pressure: Array) -> Mask:
        """No table is read."""
        return np.zeros(pressure.shape, dtype=bool)

    def _over(self, memory: Array, temperature: Array) -> Sheared:
        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            return self.law.shear(np.maximum(pressure, 0.0), speed, memory, temperature)

        return shear


def shear_change(step: Step, loads: OwnLoads, ice: IceHeat, other: InterfaceState) -> Array:
    """Relative difference of the shear (n,) between the states of `step` and the `other`.

    0 where the first is 0.
    """
    here, there = (
        loads.law.shear(
            loads.pressure,
            loads.speed,
            loads.memory(state.memory),
            ice.surface_temperature(state.ice),
        )[0]
        for state in (step.state, other)
    )
    size = np.abs(here)
    return np.divide(np.abs(there - here), size, out=np.zeros_like(size), where=size > 0.0)


def own_error(
    step: Step,
    loads: OwnLoads,
    ice: IceHeat,
    temperature_scale: Array,
    rubber: RubberHeat,
) -> Array:
    """Largest relative local error at each point: of the shear, of surface temperatures.

    The first is what the errors of memory and ice make of the shear. Infinite where anything is
    not finite.
    """
    shifted = step.state._replace(
        memory=step.state.memory + step.error(lambda change: change.memory),
        ice=step.state.ice + step.error(lambda change: change.ice),
    )
    error = np.maximum(
        shear_change(step, loads, ice, shifted),
        surface_errors(step, ice, temperature_scale, rubber),
    )
    return np.where(np.isfinite(error) & np.isfinite(step.last.friction_power), error, np.inf)
