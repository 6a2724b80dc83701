"""The history of a block under which ice passes, from that of one point of the ice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from iceslide_fem.film.conditions import transit_time
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.output.water import AMOUNTS as WATER_AMOUNTS
from iceslide_fem.scene import Scene

# Columns that are means over the contact; columns that switch at ends of steps only; energies and
# water, which are sums over the contact.
MEANS = (
    "mu", "film_height_m", "squeezed_height_m", "surface_temperature_C", "water_below_m3",
)  # fmt: skip
SWITCHES = ("melted_fraction", "saturated_fraction")
AMOUNTS = (
    "friction_work_J", "ice_heat_J", "rubber_heat_J", "latent_heat_J", "water_squeezed_m3",
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
    table["water_left_m3"] = _left(table)
    found = [kind(*values) for values in zip(*table.values(), strict=True)]
    left = duration - float(time[-1])
    if left > 1e-9 * duration:
        last = found[-1]._asdict()
        last |= {name: last[name] + left * rate for name, rate in rates.items()}
        slip = speed * duration
        last |= {"time_s": duration, "step_s": left, "slip_m": slip}
        last["water_left_m3"] = _left(last)
        found.append(kind(**last))
    return [row._replace(energy_imbalance=_imbalance(row), newton_iterations=0) for row in found]


def _left(table: Mapping[str, Any]) -> Any:
    """Water on the ice behind the block, m3."""
    kept = table["water_squeezed_m3"] - table["water_below_m3"]
    return kept + table.get("water_brought_m3", 0.0) - table.get("water_pushed_out_m3", 0.0)


def _columns(rows: list[HistoryRow]) -> dict[str, tuple[float, ...]]:
    """Name -> values of the rows."""
    return dict(zip(rows[0]._fields, zip(*rows, strict=True), strict=True))


def _imbalance(row: HistoryRow) -> float:
    """Error of the energy balance over the friction work."""
    found = row.ice_heat_J + row.rubber_heat_J + row.latent_heat_J
    return (row.friction_work_J - found) / row.friction_work_J if row.friction_work_J else 0.0


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
