"""A point in repeated passes over the same ice: one history, and a row for each pass."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from iceslide_fem.film.conditions import (
    exposure,
    ice_model,
    rubber_columns,
    scene_conditions,
    scene_passes,
    transit_time,
)
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.passes import base_temperature, column_for, next_start
from iceslide_fem.film.point_result import PointResult
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.output.table import HistoryRow, PassRow, of_pass
from iceslide_fem.output.water import AMOUNTS as WATER_AMOUNTS
from iceslide_fem.runs.point_pass import first_state, imbalance, one_pass
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene

# Columns that are means over the contact; columns that switch at ends of steps only; energies and
# water, which are sums over the contact.
MEANS = (
    "mu", "film_height_m", "squeezed_height_m", "surface_temperature_C", "water_below_m3",
)  # fmt: skip
SWITCHES = ("melted_fraction", "saturated_fraction")
AMOUNTS = (
    "friction_work_J", "ice_heat_J", "rubber_heat_J", "latent_heat_J", "hysteresis_heat_J",
    "water_squeezed_m3",
)  # fmt: skip


def block_rows(rows: list[HistoryRow], scene: Scene) -> list[HistoryRow]:
    """The history of a block on sliding ice, from that of one point of the ice.

    By transit-time equivalence (docs/explanation/passing.md) ice at x from the leading edge is
    below the block for x / v, at most since t = 0. With T = L / v the block's mean of a point value
    f is (integral of f from 0 to t + (T - t) f(t)) / T up to T, and then constant. Energies Q
    become (2 integral of Q from 0 to t + (T - t) Q(t)) / T, and grow by Q(T) / T.
    """
    duration, transit = scene.load.duration, transit_time(scene)
    kind = type(rows[0])
    reported = kind._fields[len(HistoryRow._fields) :]  # by the law
    table = {name: np.array(column, dtype=float) for name, column in _columns(rows).items()}
    time = table["time_s"]
    rest = np.maximum(transit - time, 0.0)
    whole = np.zeros_like(time)  # mu from the work is more accurate than from the ends
    speed = scene.load.speeds.first  # constant for a point on sliding ice
    whole[1:] = table["friction_work_J"][1:] / (speed * table["normal_force_N"][1:])
    amounts = (*AMOUNTS, *(name for name in reported if name in WATER_AMOUNTS))
    means = (*MEANS, *(name for name in reported if name not in WATER_AMOUNTS))
    for name in (*means, *SWITCHES):
        values = table[name]
        if name != "mu":
            ends = values[:-1] if name in SWITCHES else 0.5 * (values[1:] + values[:-1])
            whole = np.concatenate([[0.0], np.cumsum(ends * np.diff(time))])
        table[name] = (whole + rest * values) / transit
    table["friction_force_N"] = table["mu"] * table["normal_force_N"]
    rates = {}
    for name in amounts:
        values = table[name]
        rates[name] = values[-1] / transit
        whole = cumulative_trapezoid(values, time, initial=0)
        table[name] = (2.0 * whole + rest * values) / transit
    table["water_left_m3"] = left_behind(table)
    found = [kind(*values) for values in zip(*table.values(), strict=True)]
    left = duration - float(time[-1])
    if left > 1e-9 * duration:
        last = found[-1]._asdict()
        last |= {name: last[name] + left * rate for name, rate in rates.items()}
        slip = speed * duration
        last |= {"time_s": duration, "step_s": left, "slip_m": slip}
        last["water_left_m3"] = left_behind(last)
        found.append(kind(**last))
    solid = scene.ice.solid
    return [
        row._replace(energy_imbalance=imbalance(row, solid), newton_iterations=0) for row in found
    ]


def left_behind(table: Mapping[str, Any]) -> Any:
    """Water on the ice behind the block, m3."""
    kept = table["water_squeezed_m3"] - table["water_below_m3"]
    return kept + table.get("water_brought_m3", 0.0) - table.get("water_pushed_out_m3", 0.0)


def _columns(rows: list[HistoryRow]) -> dict[str, tuple[float, ...]]:
    """Name -> values of the rows."""
    return dict(zip(rows[0]._fields, zip(*rows, strict=True), strict=True))


def mean_summary(rows: list[HistoryRow]) -> dict[str, Any]:
    """Friction of a block in the summary."""
    mu, last = [row.mu for row in rows], rows[-1]
    peak = int(np.argmax(mu))
    return {
        "mu_peak": mu[peak],
        "mu_peak_time_s": rows[peak].time_s,
        "mu_mean": last.friction_work_J / (last.normal_force_N * last.slip_m),
        "mu_end": mu[-1],
        "steps": len(rows) - 1,
    }


def passes_history(
    scene: Scene, law: InterfaceLaw, observe: Callable[[PassRow], None]
) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows of all passes, with energies and water from the start of each, and the results.

    `observe` is called with the row of every pass. Raises SimulationStopped.
    """
    conditions, passes = scene_conditions(scene), scene_passes(scene)
    ice = column_for(conditions, passes, scene.numerics.tolerance, ice_model(scene))
    height, lasts = scene.initial_height, exposure(scene)
    rubber = rubber_columns(scene, passes.times(lasts))
    state, rows, found = first_state(scene, law, ice, rubber), list[HistoryRow](), list[PassRow]()
    with LongTask(passes.number, shown=rank() == 0) as task:
        for number in range(1, passes.number + 1):
            began = float(ice.surface_temperature(state.ice)[0])
            history, end = one_pass(scene, law, ice, state, False, rubber)
            if scene.ice.motion == "sliding":
                history = block_rows(history, scene)
            first = (number - 1) * passes.period
            rows += [of_pass(row, number, first) for row in history]
            row = _pass_row(scene, law, history, number, first, began, end, ice)
            observe(row)
            found.append(row)
            task.show(number, f"pass {number} of {passes.number}", f"mean mu {row.mu_mean:.3f}")
            state = next_start(end.state, law, ice, passes, height, lasts, rubber)
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
    end: PointResult,
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
        float(end.melt_onset[0]),
        began - ZERO_CELSIUS,
        ends - ZERO_CELSIUS,
        _base(scene, ice, end.state.ice),
        float(law.film_height(end.state)[0]),
        float(law.water_height(end.state)[0]),
        last.friction_work_J,
        len(history) - 1,
        int(end.rejected[0]),
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
        "saturation_s": next((row.time_s for row in rows if row.saturated_fraction), None),
        "steps": sum(one.steps for one in passes),
        "rejected_steps": sum(one.rejected_steps for one in passes),
        "passes": len(passes),
        "mu_mean_last_pass": passes[-1].mu_mean,
        "warnings": [],
    }
