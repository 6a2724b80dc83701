"""Integration of any friction law at contact points with common steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Loads, Step, advance
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene.course import Course

WHOLE = np.ones(1)  # one point with the whole pressure
FIRST_STEP, SHORTEST_STEP, LONGEST_STEP = 1e-5, 1e-13, 0.01  # of the duration


class Moment(NamedTuple):
    """State of the points at a time (s).

    step, dt: the step that ends there and its length (None and 0 at the start); shear: Pa, (n,);
    rejected: number of rejected trials of this step.
    """

    time: float
    dt: float
    state: InterfaceState
    shear: Array
    step: Step | None
    rejected: int


def moments(
    law: InterfaceLaw,
    pressure: Course,
    speed: Course,
    duration: float,
    ice: IceHeat,
    integrator: Integrator,
    tolerance: float,
    temperature_scale: float,
    rubber: RubberHeat = INSULATED,
    max_step: float | None = None,
    fractions: Array = WHOLE,
    film_height: float = 1.0,
    start: InterfaceState | None = None,
) -> Iterator[Moment]:
    """The start and every accepted step, under pressure (Pa) and slip speed (m/s) over time.

    Steps end on kinks of the loads. `fractions` (n,) are the points' fractions of the pressure.
    Films begin with `film_height` (m), if the law has films, on ice and rubber at their initial
    temperatures. A given `start` replaces this initial state.

    tolerance: target relative error of mu; temperature_scale: reference of errors of surface
    temperatures, K. An integrator without an error estimate makes steps of `max_step` (s). Raises
    SimulationStopped if the law returns an invalid result or no step is short enough.
    """
    n = fractions.size
    log_height, squeezed, internal = law.initial(film_height, n)
    state = start or InterfaceState(
        log_height, squeezed, ice.initial(n), rubber.initial(n), internal
    )
    longest = max_step or LONGEST_STEP * duration
    adaptive, time = bool(integrator.estimate), 0.0
    dt = min(FIRST_STEP * duration, longest) if adaptive else longest

    def loads_at(time: float) -> Loads:
        return law.loads(pressure.at(time) * fractions, np.full(n, speed.at(time)))

    def moment(step: Step | None, length: float) -> Moment:
        shear = loads_at(time).shear(state, ice)
        _stop_at_fault(law, time)
        return Moment(time, length, state, shear, step, rejected)

    rejected = 0
    yield moment(None, 0.0)
    while time < duration:
        corner = min(float(course.next_corner(time)) for course in (pressure, speed))
        dt = min(dt, duration - time, corner - time)
        ends = dt == duration - time
        first, last = loads_at(time), loads_at(time + dt)
        try:
            step = advance(state, first, last, dt, ice, integrator, rubber)
            scale = np.full(n, temperature_scale)
            error = float(last.local_error(step, ice, rubber, scale).max())
        except NotConverged:
            error = np.inf
        _stop_at_fault(law, time)
        if adaptive:
            error /= integrator.allowed * tolerance
        elif np.isfinite(error):  # a fixed step cannot be shortened
            error = 0.0
        following = dt * float(step_factor(error, max(integrator.estimate_order, 1)))
        if not error <= 1.0:
            dt, rejected = following, rejected + 1
            if dt < SHORTEST_STEP * duration:
                raise SimulationStopped(
                    f"the friction law {law.name} cannot be advanced beyond t = {time:.4g} s: even "
                    f"steps of {dt:.2g} s miss the tolerance"
                )
            continue
        time, state = duration if ends else time + dt, step.state
        yield moment(step, dt)
        rejected = 0
        dt = min(following, longest) if adaptive else longest


def _stop_at_fault(law: InterfaceLaw, time: float) -> None:
    if law.fault:
        raise SimulationStopped(f"{law.fault}; the run stops at t = {1e3 * time:.4g} ms")
