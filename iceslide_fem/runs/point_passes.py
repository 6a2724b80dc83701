"""A point in repeated passes over the same ice: one history, and a row for each pass."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iceslide_fem.film.conditions import (
    scene_conditions,
    scene_passes,
    simulation_settings,
)
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.passes import base_temperature, column_for, next_start
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.output.passes import PassRow, of_pass
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.runs.law_pass import law_pass
from iceslide_fem.runs.passing_point import block_rows
from iceslide_fem.runs.point_pass import PassEnd, first_state, one_pass
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.progress import LongTask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene


def passes_history(
    scene: Scene, law: InterfaceLaw, observe: Callable[[PassRow], None]
) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows of all passes, with energies and water from the start of each, and the results.

    `observe` is called with the row of every pass. Raises SimulationStopped.
    """
    conditions, passes = scene_conditions(scene), scene_passes(scene)
    settings = simulation_settings(scene)
    ice = column_for(conditions, passes, scene.numerics.tolerance, settings.pop("ice"))
    settings["ice"] = ice

    def passed(start: InterfaceState | None) -> tuple[list[HistoryRow], PassEnd]:
        if not law.has_film:
            return law_pass(scene, law, ice, start)
        history, result = one_pass(scene, law, conditions, settings, start, shown=False)
        return history, PassEnd.of(result)

    state, rows, found = first_state(scene, law, ice), list[HistoryRow](), list[PassRow]()
    with LongTask(passes.number, shown=rank() == 0) as task:
        for number in range(1, passes.number + 1):
            began = float(ice.surface_temperature(state.ice)[0])
            history, end = passed(None if number == 1 else state)
            if scene.ice.motion == "sliding":
                history = block_rows(history, scene)
            first = (number - 1) * passes.period
            rows += [of_pass(row, number, first) for row in history]
            row = _pass_row(scene, law, history, number, first, began, end, ice)
            observe(row)
            found.append(row)
            task.show(number, f"pass {number} of {passes.number}", f"mean mu {row.mu_mean:.3f}")
            state = next_start(end.state, conditions, ice, passes, scene.water.table)
    return rows, _results(found, rows)


def _base(scene: Scene, ice: Column, heat: Array) -> float:
    """Temperature (degC) of the ice's base; NaN for a half-space."""
    if scene.ice.depth is None:
        return float("nan")
    return float(base_temperature(ice, heat, scene.ice.depth)[0]) - ZERO_CELSIUS


def _pass_row(
    scene: Scene,
    law: InterfaceLaw,
    history: list[HistoryRow],
    number: int,
    start: float,
    began: float,
    end: PassEnd,
    ice: Column,
) -> PassRow:
    """Row of a pass from `start` (s), with the initial surface temperature `began` (K)."""
    mu, last = [row.mu for row in history], history[-1]
    slip = last.slip_m or 1.0
    ends = float(ice.surface_temperature(end.state.ice)[0])
    return PassRow(
        number,
        start,
        last.friction_work_J / (last.normal_force_N * slip),
        max(mu),
        mu[-1],
        end.melt_onset,
        began - ZERO_CELSIUS,
        ends - ZERO_CELSIUS,
        _base(scene, ice, end.state.ice),
        float(law.film_height(end.state)[0]),
        float(end.state.squeezed_height[0]),
        last.friction_work_J,
        len(history) - 1,
        end.rejected,
    )


def _results(passes: list[PassRow], rows: list[HistoryRow]) -> dict[str, Any]:
    """Summary entries of all passes."""
    peak = max(passes, key=lambda one: one.mu_peak)
    highest = max(rows, key=lambda row: row.mu)
    melted = [one.start_s + one.melt_onset_s for one in passes if np.isfinite(one.melt_onset_s)]
    return {
        "mu_peak": peak.mu_peak,
        "mu_peak_time_s": highest.time_s,
        "mu_mean": float(np.mean([one.mu_mean for one in passes])),
        "mu_end": passes[-1].mu_end,
        "melt_onset_s": melted[0] if melted else None,
        "saturation_s": None,
        "steps": sum(one.steps for one in passes),
        "rejected_steps": sum(one.rejected_steps for one in passes),
        "passes": len(passes),
        "mu_mean_last_pass": passes[-1].mu_mean,
        "warnings": [],
    }
