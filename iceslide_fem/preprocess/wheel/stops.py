"""Stops of a wheel's case: a table of its friction, and the stops on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.braking import (
    Stop,
    brake,
    brake_by,
    compare_controls,
    starts,
)
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import below_wheel
from iceslide_fem.preprocess.wheel.slip_table import SlipTable, axes_of_a_stop, slip_table
from iceslide_fem.preprocess.wheel.tread import TreadStiffness
from iceslide_fem.runtime.arrays import Array

LINES = 12  # representative lines of a footprint
TOLERANCE = 1e-4  # of a step: decelerations are within 2e-5 of those with 1e-7


class Stops(NamedTuple):
    """Stops of one car: by their control, and those by thresholds in all phases of a cycle.

    measured: speeds (m/s) between which a deceleration is measured.
    """

    by_control: Mapping[str, Stop]
    phases: Sequence[Stop]
    measured: tuple[float, float]

    def decelerations(self, control: str) -> Array:
        """Mean decelerations (m/s2) between the measured speeds, of all phases of a control."""
        some = self.phases if control == "threshold" else [self.by_control[control]]
        return np.array([stop.between(*self.measured) for stop in some])

    def deceleration(self, control: str) -> float:
        """Their mean, m/s2."""
        return float(self.decelerations(control).mean())


def table_of_stop(
    case: WheelCase, footprint: PressureMap, stiffness: TreadStiffness, every: int = 1
) -> SlipTable:
    """mu over the speeds and slip ratios of the stop of a case, at `every` n-th of them.

    Raises SceneError, SimulationStopped if a step fails.
    """
    speeds, slips = axes_of_a_stop(case.speed, case.end_speed)
    some = replace(footprint, pressure=footprint.sample(LINES))
    (member,) = case.members
    below = below_wheel(member, footprint, stiffness)
    return slip_table(some, thinned(speeds, every), thinned(slips, every), *below)


def stops_on(case: WheelCase, table: SlipTable, load: float) -> Stops:
    """The stops of a case with the friction of a `table`; load: on the footprint, N.

    Raises SimulationStopped if the friction is too weak to stop.
    """
    car, brakes, control = case.car(load), case.brakes, case.control
    found = compare_controls(table, case.speed, case.end_speed, car, brakes, control, TOLERANCE)
    every = phases(case, table, load, found["threshold"])
    return Stops(found, every, case.measured_from(case.speed))


def phases(case: WheelCase, table: SlipTable, load: float, first: Stop) -> list[Stop]:
    """The stop by thresholds in all phases of a cycle of the `first` one. Raises as `stops_on`."""
    speeds = starts(first, case.phases, float(table.speeds[-1]))
    rest = case.end_speed, case.car(load), case.brakes, case.control, TOLERANCE
    return [first, *(brake(table, float(speed), *rest) for speed in speeds[1:])]


def deceleration_on(case: WheelCase, table: SlipTable, load: float, control: str) -> float:
    """The measured deceleration (m/s2) of the stop by one `control`, "threshold" over its phases.

    Raises as `stops_on`.
    """
    ends, car = (case.speed, case.end_speed), case.car(load)
    first = brake_by(control, table, *ends, car, case.brakes, case.control, TOLERANCE)
    stops = phases(case, table, load, first) if control == "threshold" else [first]
    measured = case.measured_from(case.speed)
    return float(np.mean([stop.between(*measured) for stop in stops]))


def thinned(axis: Array, every: int) -> Array:
    """Every n-th place of an axis, with both ends."""
    places = np.unique([*range(0, axis.size, every), axis.size - 1])
    return np.asarray(axis[places])
