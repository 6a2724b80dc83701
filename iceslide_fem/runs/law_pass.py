"""One pass of a point over ice under a law without film events."""

from __future__ import annotations

from math import nan

from iceslide_fem.film.conditions import FIXED_STEPS, exposure, rubber_columns
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.laws.points import moments
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.runs.point_pass import PassEnd
from iceslide_fem.runs.point_rows import PointRows
from iceslide_fem.scene import Scene
from iceslide_fem.scene.course import SAMPLED


def law_pass(
    scene: Scene, law: InterfaceLaw, ice: IceHeat, start: InterfaceState | None = None
) -> tuple[list[HistoryRow], PassEnd]:
    """History rows of a pass under `law`, and its end state. Raises SimulationStopped.

    The pass begins on cold `ice`, or from the state `start`.
    """
    numerics, load, duration = scene.numerics, scene.load, exposure(scene)
    integrator = INTEGRATORS[numerics.film_integrator]
    steps = moments(
        law,
        load.pressures.sampled(SAMPLED * numerics.tolerance),
        load.speeds.sampled(SAMPLED * numerics.tolerance),
        duration,
        ice,
        integrator,
        numerics.tolerance,
        scene.ice.melting_temperature - scene.ice.temperature,
        rubber_columns(scene),
        numerics.max_step or (None if integrator.estimate else duration / FIXED_STEPS),
        film_height=scene.initial_height,
        start=start,
    )
    history, rejected = PointRows(scene, law), 0
    for moment in steps:
        rejected += moment.rejected
        warm = float(ice.surface_temperature(moment.state.ice)[0])
        step, shear = moment.step, float(moment.shear[0])
        switches = (False, False)
        if step is not None:
            switches = bool(step.last.melting[0]), bool(step.last.saturated[0])
        history.add(moment.time, moment.state, shear, warm, step, *switches)
    melts = next((row.time_s for row in history.rows if row.melted_fraction), nan)
    return history.rows, PassEnd(moment.state, melts, rejected)
