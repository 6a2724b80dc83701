"""One pass of a point over ice, with a row per step."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.conditions import rubber_columns
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.point import Conditions, PointResult, Record, simulate
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.runs.point_rows import PointRows
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.progress import LongTask
from iceslide_fem.scene import Scene


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
