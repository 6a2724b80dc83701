"""Film and heat over a coupled step, in sub-steps of their own.

Points of the ice begin to melt one after the other, which film and heat have to follow in steps
much shorter than those in which the block moves. Between the ends of a coupled step the loads of
the contact points lie on straight lines, in every sub-step as in a single one. Where ice passes, it
goes on by a cell in a sub-step at most.
"""

from __future__ import annotations

import math

from iceslide_fem.coupling.passage import Passage
from iceslide_fem.coupling.step_error import Refused, StepError
from iceslide_fem.errors import NotConverged
from iceslide_fem.film.integrators import Integrator, InterfaceState
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.interface.carriers import Carrier, ContactLoads, InterfaceStep

# So many sub-steps at most: then the coupled step is shortened.
MOST_STEPS = 24
SMALLEST_SHARE = 1e-6  # of the coupled step


class Films:
    """How film and heat on `carrier` pass over a coupled step. All is collective."""

    def __init__(
        self,
        carrier: Carrier,
        error: StepError,
        integrator: Integrator,
        longest: float = math.inf,
    ) -> None:
        """`longest`: of a sub-step, s."""
        self._carrier, self._error, self._integrator = carrier, error, integrator
        self._longest = longest
        self._adaptive = bool(integrator.estimate)

    def passage(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        first: float,
    ) -> Passage:
        """From `state` over `dt` (s), in sub-steps that their errors ask for, the `first` (s).

        Raises Refused, or NotConverged.
        """
        steps: list[InterfaceStep] = []
        ends: list[float] = []
        points = [start]
        done, wanted = 0.0, first if self._adaptive else dt
        while done < 1.0:
            left, wanted = (1.0 - done) * dt, min(wanted, self._longest)
            length = left if wanted >= left else min(wanted, 0.5 * left)
            reached = 1.0 if length == left else done + length / dt
            loads = between(start, end, reached)
            try:
                trial = self._carrier.pass_over(state, points[-1], loads, length, self._integrator)
                control = self._error.of_film(trial)
            except NotConverged:
                if not self._adaptive or not length >= SMALLEST_SHARE * dt:
                    raise
                wanted = 0.25 * length
                continue
            factor = self._factor(control)
            if control > 1.0:
                if not self._adaptive or not length >= SMALLEST_SHARE * dt:
                    raise Refused("film and heat change too fast", factor)
                wanted = factor * length
                continue
            state, done = trial.state, reached
            steps.append(trial)
            ends.append(done)
            points.append(loads)
            wanted = factor * length if length >= wanted else max(wanted, factor * length)
            if len(steps) == MOST_STEPS and done < 1.0:
                raise Refused("film and heat change too fast", done)
        return Passage(tuple(steps), tuple(ends), tuple(points[1:]), wanted)

    def again(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        before: Passage,
    ) -> Passage:
        """The same sub-steps as `before` under other loads at the end; errors up to twice as large.

        Raises Refused, or NotConverged.
        """
        steps: list[InterfaceStep] = []
        points, done = [start], 0.0
        for reached in before.ends:
            points.append(between(start, end, reached))
            length = (reached - done) * dt
            step = self._carrier.pass_over(state, points[-2], points[-1], length, self._integrator)
            control = self._error.of_film(step)
            if control > 2.0:
                raise Refused("film and heat change too fast", self._factor(control))
            steps.append(step)
            state, done = step.state, reached
        return before._replace(steps=tuple(steps), loads=tuple(points[1:]))

    def _factor(self, control: float) -> float:
        return float(step_factor(control, self._integrator.estimate_order))


def between(start: ContactLoads, end: ContactLoads, share: float) -> ContactLoads:
    """Loads at the `share` of a step, on straight lines between its ends."""
    if share == 1.0:
        return end
    return ContactLoads(
        start.positions + share * (end.positions - start.positions),
        start.pressure + share * (end.pressure - start.pressure),
        start.area + share * (end.area - start.area),
        start.speed + share * (end.speed - start.speed),
        start.offset + share * (end.offset - start.offset),
    )
