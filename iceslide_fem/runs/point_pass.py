"""One pass of a point over ice, with a row per step."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from math import nan
from operator import sub
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.conditions import FIXED_STEPS, exposure, rubber_columns
from iceslide_fem.film.contact_age import CONTACT_AREA
from iceslide_fem.film.ice_heat import Column, IceHeat
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.film.point import Conditions, PointResult, Record, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.laws.points import moments
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.output.table import HistoryRow, row_of
from iceslide_fem.output.water import PointWater
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene
from iceslide_fem.scene.course import SAMPLED

# Energies of a step, J/m2: friction work, then its sinks.
ENERGIES = ("friction_work", "ice_heat", "rubber_heat", "latent_heat")


class PointRows:
    """Rows of one point under `law`, one per accepted step from t = 0, with the block's forces.

    contact_area: k as a function of time (s), with contact age.
    """

    def __init__(
        self,
        scene: Scene,
        law: InterfaceLaw,
        contact_area: Callable[[float], float] | None = None,
    ) -> None:
        self._scene, self._law, self._contact_area = scene, law, contact_area
        self._area = scene.rubber.length * scene.rubber.width
        self._water = PointWater(law, self._area)
        self._energies = dict.fromkeys(ENERGIES, 0.0)  # J
        self._squeezed = 0.0  # m3
        self.rows: list[HistoryRow] = []

    def add(
        self,
        time: float,
        state: InterfaceState,
        shear: float,
        temperature: float,
        step: Step | None = None,
        melting: bool = False,
        saturated: bool = False,
    ) -> None:
        """Add the point at `time` (s): state, shear (Pa) and surface temperature of the ice (K).

        step: the step that ends there, None at t = 0.
        """
        area, load = self._area, self._scene.load
        dt = 0.0
        if step is not None:
            dt = time - self.rows[-1].time_s
            self._squeezed += area * float(step.squeezed[0] + step.flowed_out[0])
            for name in ENERGIES:
                self._energies[name] += area * float(getattr(step, name)[0])
        work, *taken = self._energies.values()
        missing = reduce(sub, taken, work)
        pressure, squeezed = load.pressures.at(time), float(state.squeezed_height[0])
        known = {
            "step_s": dt,
            "mu": shear / pressure,
            "film_height_m": float(self._law.film_height(state)[0]),
            "squeezed_height_m": squeezed,
            "surface_temperature_C": temperature - ZERO_CELSIUS,
            "contact_fraction": 1.0,
            "normal_force_N": pressure * area,
            "friction_force_N": shear * area,
            "melted_fraction": float(melting),
            "saturated_fraction": float(saturated),
            "energy_imbalance": missing / work if work else 0.0,
            "water_squeezed_m3": self._squeezed,
            "water_below_m3": squeezed * area,
        }
        energies = {f"{name}_J": energy for name, energy in self._energies.items()}
        internal = self._law.reported(state.internal, np.array([pressure]))
        of_law = {name: float(values[0]) for name, values in internal.items()}
        if self._contact_area is not None:
            of_law[CONTACT_AREA] = self._contact_area(time)
        of_law |= self._water.columns(state, pressure, step)
        self.rows.append(row_of(load, time, known | energies, of_law))


class PassEnd(NamedTuple):
    """End of a pass.

    state: films and ice; melt onset: s from its start, NaN without melting; rejected: number of
    rejected steps.
    """

    state: InterfaceState
    melt_onset: float
    rejected: int

    @classmethod
    def of(cls, result: PointResult) -> PassEnd:
        """The end of the single condition of a `result`."""
        return cls(result.state, float(result.melt_onset[0]), int(result.rejected[0]))


def first_state(scene: Scene, law: InterfaceLaw, ice: Column | None = None) -> InterfaceState:
    """Films on cold ice; without `ice` there is no heat state."""
    log_height, squeezed, internal = law.initial(scene.initial_height, 1)
    heat = np.zeros((0, 1)) if ice is None else ice.initial(1)
    return InterfaceState(log_height, squeezed, heat, internal=internal)


def one_pass(
    scene: Scene,
    law: InterfaceLaw,
    conditions: Conditions,
    settings: dict[str, Any],
    start: InterfaceState | None = None,
    shown: bool = True,
) -> tuple[list[HistoryRow], PointResult]:
    """Rows and result of a pass, from films on cold ice or from the state `start`.

    settings: of `point.simulate`; shown: whether to show progress. Raises SimulationStopped.
    """
    duration = float(conditions.duration[0])
    aged = settings["loading"]

    def contact_area(time: float) -> float:
        """k at `time` (s)."""
        return float(aged.at(conditions, np.array([time])).k[0])

    history = PointRows(scene, law, contact_area if scene.film.contact_age else None)
    if start is None:
        shear, kelvin = float(conditions.first_shear[0]), scene.ice.temperature
        history.add(0.0, first_state(scene, law), shear, kelvin)
    else:
        ice = settings["ice"]
        shear = float(conditions.loads(settings["water"]).shear(start, ice)[0])
        history.add(0.0, start, shear, float(ice.surface_temperature(start.ice)[0]))

    with LongTask(duration, shown=shown and rank() == 0) as task:

        def observe(record: Record) -> None:
            state = record.step.state
            history.add(
                float(record.time[0]) + float(record.dt[0]),
                state,
                float(record.loads.shear(state, record.ice)[0]),
                float(record.ice.surface_temperature(state.ice)[0]),
                record.step,
                bool(record.melting[0]),
                bool(record.full[0]),
            )
            if not shown:
                return
            row = history.rows[-1]
            where = f"t = {1e3 * row.time_s:.3f} of {1e3 * duration:g} ms"
            task.show(row.time_s, where, f"mu {row.mu:.3f}", f"step {1e3 * row.step_s:.3g} ms")

        rubber = rubber_columns(scene)
        result = simulate(conditions, observe=observe, rubber=rubber, start=start, **settings)
    return history.rows, result


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
