"""A law of the published protocol in one implicit stage, and the error of its steps.

What a law leaves to the solver: heat goes into ice and rubber, ice melts where it would get warmer
than that, and steps of implicit Euler become Runge-Kutta steps. Beside a law there is no water
film; the values of the film stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Step, surface_errors
from iceslide_fem.film.law import Film, FilmHistory, FilmStage, Surface
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.laws import protocol
from iceslide_fem.runtime.arrays import Array, Index

WARMER = 1e-4  # K, by which the fall of the heat with temperature is found


class Answer(NamedTuple):
    """A response with its state as one array: shear, by_pressure, heat (n,), internal (m, n)."""

    shear: Array
    by_pressure: Array
    heat: Array
    internal: Array


class CheckedLaw(Protocol):
    """A law whose state is one array and whose answers are checked."""

    def respond(
        self,
        pressure: Array,
        speed: Array,
        internal: Array,
        surface: protocol.Surface,
        dt: Array | float,
    ) -> Answer:
        """What the law answers in a step of `dt` (s) to pressure (Pa) and slip speed (m/s)."""

    def shear(
        self, pressure: Array, speed: Array, internal: Array, temperature: Array
    ) -> tuple[Array, Array, Array]:
        """Shear (Pa) on ice of `temperature` (K), its derivatives by pressure and by speed."""


class Places(Protocol):
    """Places that hold the internal variables, where these are not the points themselves."""

    def at_points(self, internal: Array) -> Array:
        """Internal variables (m, n) at the points of those at the places. Collective."""

    def changed(self, internal: Array, by: Array) -> Array:
        """Those of the places after points have changed theirs `by` (m, n). Collective."""


class UserLoads(NamedTuple):
    """What acts under the law at each point: pressure (Pa) and slip speed (m/s).

    places: what holds the internal variables, if it is not the points.
    """

    law: CheckedLaw
    pressure: Array
    speed: Array
    places: Places | None = None

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> UserLoads:
        """The loads: they do not follow what has been before."""
        return self

    def at(self, end: Self, fraction: float) -> UserLoads:
        """Loads at `fraction` of a step that ends with `end`, on straight lines."""
        pressure, speed = (a + fraction * (b - a) for a, b in zip(self[1:3], end[1:3], strict=True))
        return UserLoads(self.law, pressure, speed, self.places)

    def take(self, index: Index) -> UserLoads:
        """The loads at the points of `index`."""
        return self._replace(pressure=self.pressure[index], speed=self.speed[index])

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None,
        close: float,
    ) -> Film:
        """The law in a stage of `dt` (s) from `start`; always implicit."""
        internal = self._at_points(start.internal)
        return UserStage(start.log_height, start.squeezed_height, internal, dt, self)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables of the places after the `stage`, which had those `before` it."""
        if self.places is None:
            return stage.internal
        return self.places.changed(before, stage.internal - self.places.at_points(before))

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of `state` on this ice. Collective."""
        warm = ice.surface_temperature(state.ice)
        return self.law.shear(self.pressure, self.speed, self._at_points(state.internal), warm)[0]

    def force(self, step: Step) -> Array:
        """Size of tau (Pa) at the end of the `step`: its power over the speed, (n,)."""
        speed = np.maximum(np.abs(self.speed), 1e-300)
        return np.asarray(np.abs(step.last.friction_power) / speed)

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear of the `other` state; 0 where that of `state` is.
        Collective.
        """
        here, there = (self.shear(one, ice) for one in (state, other))
        size = np.abs(here)
        return np.divide(np.abs(there - here), size, out=np.zeros_like(size), where=size > 0.0)

    def local_error(self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array) -> Array:
        """Largest relative local error (n,): of the shear, and of surface temperatures over the
        `scale` (K). Collective.

        The first is what the errors of internal variables and ice make of the shear. Infinite where
        anything is not finite.
        """
        shifted = step.state._replace(
            internal=step.state.internal + step.error(lambda change: change.internal),
            ice=step.state.ice + step.error(lambda change: change.ice),
        )
        error = np.maximum(
            self.shear_change(step.state, shifted, ice), surface_errors(step, ice, scale, rubber)
        )
        return np.where(np.isfinite(error) & np.isfinite(step.last.friction_power), error, np.inf)

    def _at_points(self, internal: Array) -> Array:
        """Internal variables of the points, (m, n). Collective."""
        return internal if self.places is None else self.places.at_points(internal)


class UserStage(NamedTuple):
    """A law in one implicit stage, as the bodies below and above see it."""

    log_height: Array
    squeezed_height: Array
    internal: Array
    dt: Array | float
    loads: UserLoads

    def height(self, log_height: Array) -> Array:
        """That of a film which is not there."""
        return np.exp(log_height)

    @property
    def power_at_start(self) -> None:
        """None: the law gives it for the ice's answer only."""

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
            answer.internal,
        )

    def _response(self, ice: Surface) -> Answer:
        T_m = ice.solid.melting_temperature
        surface = protocol.Surface(ice.offset, ice.resistance, T_m, ice.melted_flux)
        loads = self.loads
        return loads.law.respond(loads.pressure, loads.speed, self.internal, surface, self.dt)
