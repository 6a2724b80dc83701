"""Stops of the wheel of a case: its friction table, and the braking with it."""

from __future__ import annotations

from dataclasses import replace

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.braking import compare_controls
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import Tread
from iceslide_fem.preprocess.wheel.law import contact_of_case
from iceslide_fem.preprocess.wheel.slip_table import axes_of_a_stop, slip_table
from iceslide_fem.preprocess.wheel.stop import Stop

LINES = 12  # representative lines of a footprint


def stops_of(case: WheelCase, footprint: PressureMap, stiffness: float) -> dict[str, Stop]:
    """Stops by name of the brake control, with a tread `stiffness` (Pa/m).

    Raises SimulationStopped if a step fails.
    """
    axes = axes_of_a_stop(case.speed, case.end_speed)
    some = replace(footprint, pressure=footprint.sample(LINES))
    tread = Tread(stiffness, case.pattern)
    contact = contact_of_case(case.members[0], footprint.contact_length)
    table = slip_table(some, *axes, tread, contact)
    return compare_controls(table, case.speed, case.end_speed, case.car(footprint.load))
