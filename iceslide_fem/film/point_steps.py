"""Steps of many points, each with a length of its own: by their errors, or as they are given."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.loads import FilmLoads, interpolate
from iceslide_fem.film.point_conditions import Conditions, InTime
from iceslide_fem.film.point_events import Events, Warmth, onset_below, until
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.step_control import GROW_ALONE, Trial, step_factor
from iceslide_fem.runtime.arrays import Array, Index, Mask

# The first step, relative to the duration and to the tolerance.
FIRST_STEP = 0.05
# Local errors of surface temperatures count so many times less than those of mu: conduction takes
# them away, and the heat that has come in has no part in them.
SURFACE_EASE = 8.0
# The step after an event, relative to what the error asked for before.
RESTART = 0.01
# So often a step is cut to where a straight line meets the event; then to a half at most.
LINES = 2
SHORTEST_STEP = 1e-13  # of the duration


class Front(NamedTuple):
    """The conditions that still run (`active`), and where each is; arrays (n,).

    time (s), duration (s); dt: length of the next step (s), cuts: of it in a row; ahead: how far
    the next event is (s); warm: w |w| (`point_events`); rate: d ln h / dt (1/s); scale: of
    temperatures (K); here: conditions at that time; their loads, state, ice and rubber.
    """

    active: Index
    time: Array
    duration: Array
    dt: Array
    cuts: Index
    ahead: Array
    warm: Array
    rate: Array
    scale: Array
    warmth: Warmth
    here: Conditions
    loads: FilmLoads
    state: InterfaceState
    ice: Column | HalfSpace
    rubber: RubberHeat

    def take(self, index: Index) -> Front:
        """The conditions at `index`."""
        parts: tuple[Any, ...] = self
        return Front(*(part.take(index) for part in parts))

    def length(self, max_step: float, loading: InTime | None) -> Array:
        """Of the next step, s: no further than the next event or corner is expected."""
        dt = np.minimum(np.minimum(self.dt, self.ahead), self.duration - self.time)
        np.minimum(dt, max_step, out=dt)
        return dt if loading is None else np.minimum(dt, loading.next_corner(self.time) - self.time)

    def melting_at(self, state: InterfaceState, loads: FilmLoads) -> Array:
        """w |w| of the films in `state` under `loads`."""
        on_ice = self.ice.surface_temperature(state.ice)

        def films() -> tuple[Array, Array]:
            power = loads.viscous * loads.speed * np.exp(log_shearing(state))
            return power, loads.height(state.log_height)

        return self.warmth(self.rubber.film_temperature(on_ice, state.rubber, films))

    def cut(self, ahead: Array, event: Events, dt: Array) -> tuple[Array, Index]:
        """How far the next events are (s), `ahead` where none is in the step, and cuts in a row."""
        cuts = np.zeros_like(self.cuts)
        cuts[event.across] = self.cuts[event.across] + 1
        many = cuts[event.across] > LINES
        fraction = np.where(many, np.minimum(event.fraction, 0.5), event.fraction)
        ahead[event.across] = fraction * dt[event.across]
        return ahead, cuts


class StepLengths(Protocol):
    """How long the steps of a `Front` are."""

    def first(self, conditions: Conditions, loads: FilmLoads) -> Array:
        """Length of the first steps, s."""

    def judge(
        self, front: Front, trial: Trial, event: Events, dt: Array, last: FilmLoads
    ) -> tuple[Mask, Array]:
        """Where the `trial` steps of `dt` (s) to the loads `last` are good, and the next ones, s.

        Across an event none is.
        """

    def stuck(self, bad: Index, event: Events, front: Front, dt: Array) -> Index:
        """Where steps that are `bad` cannot be made shorter than the next `dt` (s)."""

    def ahead(self, front: Front, step: Step, warm: Array, last: FilmLoads, band: float) -> Array:
        """When after the `step`, which ends `warm`, the next event is expected, s."""


class ByError(NamedTuple):
    """Steps whose relative error of mu(t) is about the tolerance."""

    tolerance: float
    loading: InTime | None

    def first(self, conditions: Conditions, loads: FilmLoads) -> Array:
        """A fraction of the duration, and so short that the surface hardly warms.

        The error of the surface's temperature is about half its first rise, however short that.
        """
        undercooling = conditions.melting_temperature - conditions.temperature
        power = conditions.first_shear * loads.speed
        onset = onset_below(power, undercooling, conditions.solid)
        first = min(FIRST_STEP * self.tolerance, 0.01) * conditions.duration
        return np.minimum(first, (SURFACE_EASE * self.tolerance) ** 2 * onset)

    def judge(
        self, front: Front, trial: Trial, event: Events, dt: Array, last: FilmLoads
    ) -> tuple[Mask, Array]:
        """By their errors and by how far loads leave straight lines.

        A step that was cut says nothing against a longer one. Across an event its error means
        nothing; behind it the solution has a kink that an estimate can overlook unless the steps
        grow from short ones again.
        """
        _, good, following = trial
        if self.loading is not None:
            middle = self.loading.at(front.here, front.time + 0.5 * dt).loads()
            bent = _bend(front.loads, middle, last)
            good &= bent <= self.tolerance
            longest = dt * step_factor(bent / self.tolerance, 2, GROW_ALONE)
            following = np.minimum(following, longest)
        np.maximum(following, front.dt, out=following, where=good & (dt < front.dt))
        begun = np.flatnonzero(event.melting | event.full)
        following[begun] = RESTART * front.dt[begun]
        following[event.across] = front.dt[event.across]
        good[event.across] = False
        return good, following

    def stuck(self, bad: Index, event: Events, front: Front, dt: Array) -> Index:
        """Where they are of no length."""
        return bad[dt[bad] < SHORTEST_STEP * front.duration[bad]]

    def ahead(self, front: Front, step: Step, warm: Array, last: FilmLoads, band: float) -> Array:
        """By straight lines and parabolas of their progress."""
        return until(step, front.warm, warm, front.state.squeezed_height, last, band)


class AsGiven(NamedTuple):
    """Steps of one length (s); they end on events all the same."""

    step: float

    def first(self, conditions: Conditions, loads: FilmLoads) -> Array:
        """The length."""
        return np.full(conditions.pressure.size, self.step)

    def judge(
        self, front: Front, trial: Trial, event: Events, dt: Array, last: FilmLoads
    ) -> tuple[Mask, Array]:
        """Where they are numbers."""
        good = trial.good
        good[event.across] = False
        return good, front.dt

    def stuck(self, bad: Index, event: Events, front: Front, dt: Array) -> Index:
        """Wherever they are bad, but for an event."""
        return np.setdiff1d(bad, event.across)

    def ahead(self, front: Front, step: Step, warm: Array, last: FilmLoads, band: float) -> Array:
        """Never: steps are cut when they have met one."""
        return np.full_like(front.ahead, np.inf)


def _bend(start: FilmLoads, middle: FilmLoads, end: FilmLoads) -> Array:
    """How far loads in the middle of a step are from the line between its ends, relative."""
    line = interpolate(start, end, 0.5)
    gaps = (
        np.abs(getattr(middle, name) - getattr(line, name))
        / np.maximum(np.abs(getattr(end, name)), np.abs(getattr(start, name)) + 1e-300)
        for name in ("viscous", "squeeze_rate")
    )
    return np.maximum(*gaps)
