"""Subcycling of film and heat: substeps within a coupled step.

Points of the ice begin to melt one after the other. Film and heat follow this in steps much shorter
than those of the block. The contact loads are linear in time over a coupled step. Sliding ice moves
by at most one cell in a substep.
"""

from __future__ import annotations

import math

from iceslide_fem.coupling.step_error import StepError, StepRejected
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.interface.film_frame import ContactLoads, FilmFrame, InterfaceStep
from iceslide_fem.runtime.errors import NotConverged

SMALLEST_FRACTION = 1e-6  # of the coupled step
TOO_FAST = "film and heat change too fast"


class Subcycling:
    """Advances film and heat on `frame` over coupled steps. All is collective."""

    def __init__(
        self,
        frame: FilmFrame,
        error: StepError,
        integrator: Integrator,
        longest: float = math.inf,
    ) -> None:
        """`longest`: largest length of a substep, s."""
        self._frame, self._error, self._integrator = frame, error, integrator
        self._longest, self._most = longest, error.limits.most_substeps
        self._adaptive = bool(integrator.estimate)

    def advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        first_dt: float,
    ) -> Subcycles:
        """Advance `state` over `dt` (s), in substeps by error control; the first is `first_dt`.

        Raises StepRejected, or NotConverged.
        """
        substeps: list[InterfaceStep] = []
        ends: list[float] = []
        points = [start]
        done, wanted = 0.0, first_dt if self._adaptive else dt
        while done < 1.0:
            left, wanted = (1.0 - done) * dt, min(wanted, self._longest)
            length = left if wanted >= left else min(wanted, 0.5 * left)
            reached = 1.0 if length == left else done + length / dt
            loads = between(start, end, reached)
            may_shorten = self._adaptive and length >= SMALLEST_FRACTION * dt
            try:
                trial = self._frame.advance(state, points[-1], loads, length, self._integrator)
                error = self._error.of_film(trial)
            except NotConverged:
                if not may_shorten:
                    raise
                wanted = 0.25 * length
                continue
            factor = self._factor(error)
            if error > 1.0:
                if not may_shorten:
                    raise StepRejected(TOO_FAST, factor)
                wanted = factor * length
                continue
            state, done = trial.state, reached
            substeps.append(trial)
            ends.append(done)
            points.append(loads)
            wanted = factor * length if length >= wanted else max(wanted, factor * length)
            if len(substeps) == self._most and done < 1.0:
                raise StepRejected(TOO_FAST, done)
        return Subcycles(tuple(substeps), tuple(ends), tuple(points[1:]), wanted)

    def repeat(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        before: Subcycles,
    ) -> Subcycles:
        """Repeat the substeps of `before` under new loads at the end. Errors up to 2 are accepted.

        Raises StepRejected, or NotConverged.
        """
        substeps: list[InterfaceStep] = []
        points, done = [start], 0.0
        for reached in before.ends:
            points.append(between(start, end, reached))
            length = (reached - done) * dt
            one = self._frame.advance(state, points[-2], points[-1], length, self._integrator)
            error = self._error.of_film(one)
            if error > 2.0:
                raise StepRejected(TOO_FAST, self._factor(error))
            substeps.append(one)
            state, done = one.state, reached
        return before._replace(substeps=tuple(substeps), loads=tuple(points[1:]))

    def _factor(self, error: float) -> float:
        return float(step_factor(error, self._integrator.estimate_order))


def between(start: ContactLoads, end: ContactLoads, fraction: float) -> ContactLoads:
    """Loads at a `fraction` of a step, interpolated linearly between its ends."""
    if fraction == 1.0:
        return end
    return ContactLoads(
        start.positions + fraction * (end.positions - start.positions),
        start.pressure + fraction * (end.pressure - start.pressure),
        start.area + fraction * (end.area - start.area),
        start.speed + fraction * (end.speed - start.speed),
        start.offset + fraction * (end.offset - start.offset),
    )
