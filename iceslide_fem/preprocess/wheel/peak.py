"""The largest friction of a wheel over slip, between its slip ratios, and that of a locked one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import below_wheel
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.slip_table import slips_of_a_stop
from iceslide_fem.preprocess.wheel.stops import LINES, thinned
from iceslide_fem.preprocess.wheel.tread import TreadStiffness

BETWEEN = 11  # slip ratios on both sides of the largest one


def peak_and_locked(
    case: WheelCase, footprint: PressureMap, stiffness: TreadStiffness, every: int = 1
) -> dict[str, float]:
    """`mu_peak` and `mu_locked` of a case, from `every` n-th slip ratio and those around the peak.

    Raises SceneError, SimulationStopped if a step fails.
    """
    some = replace(footprint, pressure=footprint.sample(LINES))
    (member,) = case.members
    below = below_wheel(member, footprint, stiffness)
    slips = thinned(slips_of_a_stop(), every)[1:]
    mu = [one.mu for one in friction(some, [case.rolling(s) for s in slips], *below)]
    top = int(np.argmax(mu))
    near = slips[max(top - 1, 0)], slips[min(top + 1, slips.size - 1)]
    finer = np.geomspace(*near, BETWEEN)
    more = [one.mu for one in friction(some, [case.rolling(s) for s in finer], *below)]
    return {"mu_peak": float(max(*mu, *more)), "mu_locked": float(mu[-1])}
