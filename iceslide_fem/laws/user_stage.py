"""A user law in one implicit stage, and the error of its steps.

The solver does the rest: heat flows into ice and rubber, ice melts at T_m, and implicit Euler steps
form Runge-Kutta steps. A user law has no water film; the film's values stay constant.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import EVEN, InterfaceState, Step, Weights, surface_errors
from iceslide_fem.film.law import Film, FilmHistory, FilmStage, Surface
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.laws import protocol
from iceslide_fem.runtime.arrays import Array, Index, Mask

WARMER = 1e-4  # K, increment for the numerical derivative of heat with temperature


class Answer(NamedTuple):
    """A response with its state in one array: shear, by_pressure, heat (n,), internal (m, n)."""

    shear: Array
    by_pressure: Array
    heat: Array
    internal: Array


class CheckedLaw(Protocol):
    """A law with its state in one array and checked results."""

    def respond(
        self,
        pressure: Array,
        speed: Array,
        internal: Array,
        surface: protocol.Surface,
        dt: Array | float,
    ) -> Answer:
        """Response in a step of `dt` (s) to pressure (Pa) and slip speed (m/s)."""

    def shear(
        self, pressure: Array, speed: Array, internal: Array, temperature: Array
    ) -> tuple[Array, Array, Array]:
        """Shear (Pa) on ice of `temperature` (K), and its derivatives with pressure and speed."""


class Places(Protocol):
    """Places, other than the points, that hold the internal variables."""

    def at_points(self, internal: Array) -> Array:
        """Internal variables interpolated to the points, (m, n). Collective."""

    def changed(self, internal: Array, by: Array) -> Array:
        """Internal variables of the places after changes `by` (m, n) at points. Collective."""


class UserLoads(NamedTuple):
    """Loads of a user law at each point: pressure (Pa) and slip speed (m/s).

    places: holder of the internal variables, None if the points hold them.
    """

    law: CheckedLaw
    pressure: Array
    speed: Array
    places: Places | None = None

    @property
    def alone(self) -> bool:
        """Yes: there is no film."""
        return True

    @property
    def viscous(self) -> Array:
        """1: the shear of a stage is the stress."""
        return np.ones_like(self.pressure)

    @property
    def free_height(self) -> Array:
        """1 m: voids without water are never full."""
        return np.ones_like(self.pressure)

    def height(self, log_height: Array) -> Array:
        """Height of a film that does not exist."""
        return np.exp(log_height)

    def wet(self, state: FilmHistory) -> Mask:
        """Nowhere."""
        return np.zeros(self.pressure.shape, dtype=bool)

    def overfreezes(self, step: Step, ice: IceHeat) -> Mask:
        """Nowhere."""
        return np.zeros(self.pressure.shape, dtype=bool)

    def stress(self, stage: FilmStage) -> Array:
        """tau (Pa) at the end of a `stage`."""
        return stage.shearing

    def bend(self, middle: UserLoads, end: UserLoads) -> Array:
        """Relative distance of loads in the `middle` of a step from the line between its ends."""
        line = self.at(end, 0.5)
        gaps = (
            np.abs(there - here) / np.maximum(np.maximum(np.abs(first), np.abs(last)), 1e-300)
            for first, here, there, last in zip(
                self[1:3], line[1:3], middle[1:3], end[1:3], strict=True
            )
        )
        return np.maximum(*gaps)

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> UserLoads:
        """These loads: they do not depend on the history."""
        return self

    def at(self, end: Self, fraction: float) -> UserLoads:
        """Loads at `fraction` of a step that ends with `end`, by linear interpolation."""
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
        """Internal variables of the places after the `stage`, from those `before` it."""
        if self.places is None:
            return stage.internal
        return self.places.changed(before, stage.internal - self.places.at_points(before))

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of `state` on this ice. Collective."""
        warm = ice.surface_temperature(state.ice)
        return self.law.shear(self.pressure, self.speed, self._at_points(state.internal), warm)[0]

    def force(self, step: Step) -> Array:
        """Magnitude of tau (Pa) at the end of the `step`: its power over the speed, (n,)."""
        speed = np.maximum(np.abs(self.speed), 1e-300)
        return np.asarray(np.abs(step.last.friction_power) / speed)

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear in the `other` state to that in `state`.

        0 where the shear in `state` is 0. Collective.
        """
        here, there = (self.shear(one, ice) for one in (state, other))
        size = np.abs(here)
        return np.divide(np.abs(there - here), size, out=np.zeros_like(size), where=size > 0.0)

    def local_error(
        self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array, weights: Weights = EVEN
    ) -> Array:
        """Largest relative local error (n,): of shear, and of surface temperatures. Collective.

        The error of the shear follows from errors of internal variables and ice. Temperatures are
        relative to `scale` (K). Infinite if a value is not finite.
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
    """A user law in one implicit stage, as the bodies use it."""

    log_height: Array
    squeezed_height: Array
    internal: Array
    dt: Array | float
    loads: UserLoads

    def height(self, log_height: Array) -> Array:
        """Height of a film that does not exist."""
        return np.exp(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """The response of the law to the ice's thermal response; excess heat melts ice.

        Without melting, the slope of heat with temperature is that of the law. With melting, it is
        that of the flux that holds the ice at T_m. No slope is taken across this kink.
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
            answer.shear,
        )

    def _response(self, ice: Surface) -> Answer:
        T_m = ice.solid.melting_temperature
        surface = protocol.Surface(ice.offset, ice.resistance, T_m, ice.melted_flux)
        loads = self.loads
        return loads.law.respond(loads.pressure, loads.speed, self.internal, surface, self.dt)
