"""Loads of films under ageing contact: k, D and H_V change from stage to stage.

The stored loads are those of fresh contact. The age multiplies them by ratios of the table at p_e
and at p. Averages of such loads over places therefore do not depend on the age.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.contact_age import ContactAge
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.film.law import FilmHistory, FilmStage
from iceslide_fem.film.loads import FilmLoads, FilmOnIce
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.contact_table import ContactParameters

# Parts of a linear piece of the pressure history. The largest p_e is updated after each.
PARTS = 8
YOUNGEST = 1e-8  # of the duration


@dataclass(frozen=True)
class AgedLoading:
    """The contact `age` under the constant pressures of the conditions, or under `loads`."""

    age: ContactAge
    loads: Loading | None = None

    def at(self, here: Conditions, time: Array) -> Conditions:
        """The conditions at `time` (s, one per point)."""
        if self.loads is None or self.loads.pressure.is_constant:
            here = here if self.loads is None else self.loads.at(here, time)
            old = time + YOUNGEST * here.duration
            k, D, H_V, _ = self.age.under_constant(here.pressure, old, here.temperature)
            return here._replace(k=k, D=D, H_V=H_V)
        here = self.loads.at(here, time)
        k, D, H_V = np.empty((3, time.size))
        for temperature in np.unique(here.temperature):
            of = np.flatnonzero(here.temperature == temperature)
            found = self._under_course(here.pressure[of], time[of], float(temperature))
            k[of], D[of], H_V[of] = found[:3]
        return here._replace(k=k, D=D, H_V=H_V)

    def next_corner(self, time: Array) -> Array:
        """Time of the next kink of a load (s)."""
        return np.full_like(time, np.inf) if self.loads is None else self.loads.next_corner(time)

    def _under_course(self, pressure: Array, time: Array, temperature: float) -> ContactParameters:
        """k, D and H_V at `time` (s) under the pressure (Pa) at that time."""
        times, pressures = self._parts
        before = np.maximum(times.searchsorted(time) - 1, 0)
        reduced = self.age.relaxation.reduced(time - times[before], temperature)
        history = self._histories(temperature)[:, before]
        now = self.age.after(history, pressures[before], pressure, pressure, reduced)
        return self.age.so_far(now)(pressure)

    def _histories(self, temperature: float) -> Array:
        """History variables at the ends of all parts, (rows, n), for one rubber temperature (K)."""
        if temperature not in self._known:
            times, pressures = self._parts
            steps = self.age.relaxation.reduced(np.diff(times), temperature)
            first = pressures[:1]
            young = self.age.relaxation.reduced(np.full(1, YOUNGEST * times[-1]), temperature)
            history = [self.age.after(self.age.fresh(1), first, first, first, young)]
            for number, step in enumerate(steps):
                start, end = pressures[number : number + 1], pressures[number + 1 : number + 2]
                history.append(self.age.after(history[-1], start, end, end, np.array([step])))
            self._known[temperature] = np.concatenate(history, axis=1)
        return self._known[temperature]

    @cached_property
    def _known(self) -> dict[float, Array]:
        return {}

    @cached_property
    def _parts(self) -> tuple[Array, Array]:
        """Times (s) of the piecewise linear pressure history, and its values (Pa)."""
        assert self.loads is not None
        course = self.loads.pressure
        ends = np.array([0.0, *course.corners, course.duration])
        parts = np.arange(PARTS) / PARTS
        inside = (ends[:-1, None] + parts * np.diff(ends)[:, None]).ravel()
        times = np.append(inside, ends[-1])
        return times, course(times)


class AgedLoads(NamedTuple):
    """Loads of films at an end of a step; arrays (n,).

    touching: loads of fresh contact; pressure: over the contact part of a place, Pa; mean: over the
    whole place, Pa; temperature: of rubber that takes no heat, K.

    The internal variables are first those of the film, then the contact's history.
    """

    age: ContactAge
    temperature: float
    touching: FilmLoads
    pressure: Array
    mean: Array

    def take(self, index: Index) -> AgedLoads:
        """The loads at `index`."""
        pressure, mean = self.pressure.take(index), self.mean.take(index)
        return self._replace(touching=self.touching.take(index), pressure=pressure, mean=mean)

    def completed(self, covered: Mask, other: AgedLoads) -> AgedLoads:
        """As of `FilmLoads`."""
        return self._replace(touching=self.touching.completed(covered, other.touching))

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> AgedStep:
        """A step of `dt` (s) from `state`, with the rubber's temperature at its start."""
        kelvin = rubber.at_contact(state.rubber, ice, state.ice)
        if kelvin is None:
            kelvin = np.full_like(self.pressure, self.temperature)
        reduced = self.age.relaxation.reduced(dt, kelvin)
        return AgedStep(self, state.internal[-self.age.rows :], reduced)

    def under(self, history: Array) -> FilmLoads:
        """Film loads under contact with this `history`."""
        contact = self.age.so_far(history)
        new, old = self.age.table(self.pressure), contact(self.pressure)
        return self.touching._replace(
            viscous=self.touching.viscous * (old.k / new.k),
            squeeze_rate=self.touching.squeeze_rate * (new.D / old.D) ** 2,
            free_height=self.touching.free_height * (old.H_V / new.H_V),
        )

    def of(self, state: FilmHistory) -> FilmLoads:
        """Film loads under contact with the history in `state`."""
        return self.under(state.internal[-self.age.rows :])

    def growth(self, state: FilmHistory) -> Array:
        """Ratio of k in `state` to k of fresh contact, (n,)."""
        contact = self.age.so_far(state.internal[-self.age.rows :])
        old, _ = contact.contact_area(self.pressure)
        return np.asarray(old / self.age.table.contact_area(self.pressure)[0])

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of films in `state`, independent of the ice."""
        return self.of(state).shear(state, ice)

    def force(self, step: Step) -> Array:
        """Magnitude of tau (Pa) at the end of the `step`, (n,)."""
        return self.of(step.state).force(step)

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear in the `other` state to the shear in `state`."""
        grown = np.log(self.growth(other) / self.growth(state))
        return self.touching.shear_change(state, other, ice) + grown

    def local_error(self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array) -> Array:
        """Relative local errors (n,) of a step that ends here; `scale` of temperatures, K."""
        return self.of(step.state).local_error(step, ice, rubber, scale)


class AgedStep(NamedTuple):
    """A step from the loads `start` and their history; reduced: its reduced time, s."""

    start: AgedLoads
    history: Array
    reduced: Array

    def at(self, end: AgedLoads, fraction: float) -> AgedStage:
        """Loads at `fraction` of the step that ends with `end`, by linear interpolation."""
        start = self.start
        pressure = start.pressure + fraction * (end.pressure - start.pressure)
        mean = start.mean + fraction * (end.mean - start.mean)
        reduced = fraction * self.reduced
        history = start.age.after(self.history, start.mean, mean, pressure, reduced)
        touching = start.touching.at(end.touching, fraction)
        here = end._replace(touching=touching, pressure=pressure, mean=mean)
        return AgedStage(here.under(history), history)


class AgedStage(NamedTuple):
    """Film loads in a stage, with the contact's history at its end."""

    loads: FilmLoads
    history: Array

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None = None,
        close: float = CLOSE,
    ) -> FilmOnIce:
        """As of `FilmLoads`."""
        return self.loads.film(start, before, dt, stage, near, close)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables of the film after the `stage` (0 if none), then the history."""
        of_film = before[: -len(self.history)]
        if len(stage.internal):
            of_film = stage.internal
        return np.concatenate([of_film, self.history])
