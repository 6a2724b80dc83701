"""What acts on points over time: loads at any time, and the history of their contact."""

from __future__ import annotations

from typing import NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Loads, Step
from iceslide_fem.film.law import FilmStage
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.runtime.curve import Curve


class PointLoads(Loads, Protocol):
    """Loads of points, as the integrator of points uses them; arrays (n,)."""

    @property
    def speed(self) -> Array:
        """Slip speed, m/s."""

    @property
    def viscous(self) -> Array:
        """c, for tau = c times the exponential of `film.law.log_shearing`."""

    @property
    def free_height(self) -> Array:
        """H_V, m; of no meaning for a law without films."""

    @property
    def alone(self) -> bool:
        """Whether a stage has no other unknown than the film's height."""

    def height(self, log_height: Array) -> Array:
        """h (m) of films."""

    def stress(self, stage: FilmStage) -> Array:
        """tau (Pa) at the end of a `stage` under these loads."""

    def wet(self, state: InterfaceState) -> Mask:
        """Where water that may freeze holds the ice's surface at T_m."""

    def overfreezes(self, step: Step, ice: IceHeat) -> Mask:
        """Where stages of a `step` that ends here freeze more water on cold ice than there is."""

    def at(self, end: Self, fraction: float) -> Self:
        """Loads at `fraction` of a step that ends with `end`."""

    def bend(self, middle: Self, end: Self) -> Array:
        """Relative distance of loads in the `middle` of a step from the line between its ends."""


SHORTER = "take a shorter one, or an implicit integrator"


class Drive(Protocol):
    """Loads of points over time; times (s) are one per point, (n,)."""

    @property
    def advice(self) -> str:
        """What to do if a step fails, in words."""

    @property
    def constant(self) -> bool:
        """Whether all loads are constant."""

    def loads(self, time: Array, age: Array) -> PointLoads:
        """Loads at a time, with the history of the contact."""

    def pressure(self, time: Array) -> Array:
        """Nominal pressure, Pa."""

    def next_corner(self, time: Array) -> Array:
        """Time of the next kink, s."""

    def aged(self, age: Array, time: Array, dt: Array, kelvin: Array | None) -> Array:
        """History of the contact `dt` (s) after `time`; kelvin: of the rubber's surface, K."""

    def together(self, dt: Array) -> Array:
        """Steps of these lengths (s), of one length if the law needs that."""

    def agreed(self, good: Mask) -> Mask:
        """Mask of accepted steps: all or none if they are of one length."""

    def check(self, time: Array) -> None:
        """Raise SimulationStopped if the law has returned an invalid result, at `time` (s)."""

    def subject(self, number: int, time: Array) -> str:
        """A point in words for messages, by its number and the times (s)."""

    def take(self, index: Index) -> Drive:
        """The same at the points of `index`."""


class Driven(NamedTuple):
    """Films under `conditions`, whose loads may change (`loading`); water: see `point.simulate`."""

    conditions: Conditions
    loading: Loading | None = None
    water: Curve | None = None

    @property
    def advice(self) -> str:
        """A shorter step, or an implicit integrator."""
        return SHORTER

    @property
    def constant(self) -> bool:
        """Whether nothing changes."""
        return self.loading is None

    def loads(self, time: Array, age: Array) -> FilmLoads:
        """Loads at a time, with the history of the contact."""
        here = self.conditions
        if self.loading is not None:
            here = self.loading.at(here, time, age)
        return here.loads(self.water)

    def pressure(self, time: Array) -> Array:
        """Nominal pressure, Pa."""
        if self.loading is None:
            return self.conditions.pressure
        return self.loading.pressure_at(self.conditions, time)

    def next_corner(self, time: Array) -> Array:
        """Time of the next kink, s; infinite without one."""
        return (
            np.full_like(time, np.inf) if self.loading is None else self.loading.next_corner(time)
        )

    def aged(self, age: Array, time: Array, dt: Array, kelvin: Array | None) -> Array:
        """History of the contact `dt` (s) after `time`."""
        if self.loading is None or self.loading.age is None:
            return age
        first, last = (self.pressure(one) for one in (time, time + dt))
        aging, own = self.loading.age, self.loading.rubber
        if kelvin is None:
            kelvin = self.conditions.temperature if own is None else np.full_like(dt, own)
        return aging.after(age, first, last, aging.relaxation.reduced(dt, kelvin))

    def together(self, dt: Array) -> Array:
        """The same: each point has its own steps."""
        return dt

    def agreed(self, good: Mask) -> Mask:
        """The same."""
        return good

    def check(self, time: Array) -> None:
        """Nothing: the film law has no faults."""

    def subject(self, number: int, time: Array) -> str:
        """The film by pressure and speed."""
        here = self.conditions
        speed = here.speed
        if self.loading is not None and self.loading.speed is not None:
            speed = self.loading.speed(time)
        return f"the film at {self.pressure(time)[number]:.4g} Pa and {speed[number]:.4g} m/s"

    def take(self, index: Index) -> Driven:
        """The same at the points of `index`."""
        return self._replace(conditions=self.conditions.take(index))


def history_after(
    drive: Drive, state: InterfaceState, time: Array, dt: Array, ice: IceHeat, rubber: RubberHeat
) -> Array:
    """History of the contact `dt` (s) after `time`, with the rubber's temperature in `state`."""
    if not len(state.age):
        return state.age
    return drive.aged(state.age, time, dt, rubber.at_contact(state.rubber, ice, state.ice))
