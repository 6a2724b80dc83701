"""Step lengths of many points, one each: by error control, or fixed."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.driving import Drive, PointLoads, history_after
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.film.point_events import Events, Warmth, until
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.step_control import GROW_ALONE, Trial, step_factor
from iceslide_fem.runtime.arrays import Array, Index, Mask

# Bounds of the first step, relative to the duration and to the tolerance.
FIRST_STEP = 0.05
# Local errors of surface temperatures have this many times less weight than those of mu. Conduction
# damps them, and they do not affect the heat in the ice.
SURFACE_EASE = 8.0
# First step after an event, over the step length that error control gave before it.
RESTART = 0.01
# Number of cuts of a step by linear interpolation of the event; later cuts at least halve it.
LINES = 2
SHORTEST_STEP = 1e-13  # of the duration


class Front(NamedTuple):
    """The running conditions (`active`) and their present state; arrays (n,).

    time, duration: s; dt: length of the next step, s; cuts: consecutive cuts of it; ahead: expected
    time to the next event, s; warm: w |w| (`point_events`); rate: d ln h / dt, 1/s; scale:
    reference temperature, K; drive: what acts, with loads, state, ice and rubber at that time.
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
    drive: Drive
    loads: PointLoads
    state: InterfaceState
    ice: Column | HalfSpace
    rubber: RubberHeat

    def take(self, index: Index) -> Front:
        """The conditions at `index`."""
        parts: tuple[Any, ...] = self
        return Front(*(part.take(index) for part in parts))

    def length(self, max_step: float) -> Array:
        """Length of the next step, s, at most to the next expected event or kink."""
        dt = np.minimum(np.minimum(self.dt, self.ahead), self.duration - self.time)
        np.minimum(dt, max_step, out=dt)
        if not self.drive.constant:
            dt = np.minimum(dt, self.drive.next_corner(self.time) - self.time)
        return self.drive.together(dt)

    def melting_at(self, state: InterfaceState, loads: PointLoads) -> Array:
        """w |w| of the films in `state` under `loads`; 1 where water may freeze."""
        on_ice = self.ice.surface_temperature(state.ice)

        def films() -> tuple[Array, Array]:
            return loads.shear(state, self.ice) * loads.speed, loads.height(state.log_height)

        warm = self.warmth(self.rubber.film_temperature(on_ice, state.rubber, films))
        return np.where(loads.wet(state), 1.0, warm)

    def cut(self, ahead: Array, event: Events, dt: Array) -> tuple[Array, Index]:
        """Time to the next events (s), `ahead` if none is in the step, and consecutive cuts."""
        cuts = np.zeros_like(self.cuts)
        cuts[event.across] = self.cuts[event.across] + 1
        many = cuts[event.across] > LINES
        fraction = np.where(many, np.minimum(event.fraction, 0.5), event.fraction)
        ahead[event.across] = fraction * dt[event.across]
        return ahead, cuts


class StepLengths(Protocol):
    """Choice of the step lengths of a `Front`."""

    def first(self, duration: Array, onset: Array) -> Array:
        """Length of the first steps, s, of points with an `onset` (s) of melting by their first
        friction.
        """

    def judge(
        self, front: Front, trial: Trial, event: Events, dt: Array, last: PointLoads
    ) -> tuple[Mask, Array]:
        """Mask of accepted `trial` steps of `dt` (s) to the loads `last`, and next lengths, s.

        A step across an event is rejected.
        """

    def stuck(self, bad: Index, event: Events, front: Front, dt: Array) -> Index:
        """Numbers of `bad` steps that cannot be shortened; dt: next length, s."""

    def ahead(self, front: Front, step: Step, warm: Array, last: PointLoads, band: float) -> Array:
        """Expected time from the end of `step` to the next event, s; warm: w |w| at its end."""


class ByError(NamedTuple):
    """Steps by error control: the relative error of mu(t) is about the tolerance."""

    tolerance: float

    def first(self, duration: Array, onset: Array) -> Array:
        """A fraction of the duration, short enough that the surface hardly warms.

        The error of the surface temperature is about half of its first rise, for any step length.
        """
        first = min(FIRST_STEP * self.tolerance, 0.01) * duration
        return np.minimum(first, (SURFACE_EASE * self.tolerance) ** 2 * onset)

    def judge(
        self, front: Front, trial: Trial, event: Events, dt: Array, last: PointLoads
    ) -> tuple[Mask, Array]:
        """Judge by local errors and by the nonlinearity of loads.

        A cut step does not limit the next one. The error of a step across an event has no meaning.
        After an event the solution has a kink that the error estimate may miss, so steps start
        short again.
        """
        _, good, following = trial
        if not front.drive.constant:
            half = 0.5 * dt
            bodies = front.ice, front.rubber
            age = history_after(front.drive, front.state, front.time, half, *bodies)
            middle = front.drive.loads(front.time + half, age)
            bent = front.loads.bend(middle, last)
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
        """Bad steps shorter than `SHORTEST_STEP`."""
        return bad[dt[bad] < SHORTEST_STEP * front.duration[bad]]

    def ahead(self, front: Front, step: Step, warm: Array, last: PointLoads, band: float) -> Array:
        """By linear and quadratic extrapolation of the progress."""
        return until(step, front.warm, warm, front.state.squeezed_height, last, band)


class AsGiven(NamedTuple):
    """Fixed steps of one length (s), which also end on events."""

    step: float

    def first(self, duration: Array, onset: Array) -> Array:
        """The length."""
        return np.full_like(duration, self.step)

    def judge(
        self, front: Front, trial: Trial, event: Events, dt: Array, last: PointLoads
    ) -> tuple[Mask, Array]:
        """Accept all steps with finite values."""
        good = trial.good
        good[event.across] = False
        return good, front.dt

    def stuck(self, bad: Index, event: Events, front: Front, dt: Array) -> Index:
        """All bad steps without an event."""
        return np.setdiff1d(bad, event.across)

    def ahead(self, front: Front, step: Step, warm: Array, last: PointLoads, band: float) -> Array:
        """Infinite: fixed steps are cut after they pass an event."""
        return np.full_like(front.ahead, np.inf)
