"""One scene on the point rung: the same history and summary as the rungs with rubber."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from iceslide_fem.arrays import Array
from iceslide_fem.film.conditions import (
    rubber_columns,
    scene_conditions,
    simulation_settings,
    transit_time,
)
from iceslide_fem.film.doubts import doubts
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.own_law import law_of
from iceslide_fem.film.point import Conditions, PointResult, Record, simulate
from iceslide_fem.launch import rank
from iceslide_fem.materials import ZERO_CELSIUS
from iceslide_fem.output.table import FILM_VISCOSITY, HistoryRow, row_of
from iceslide_fem.progress import LongTask
from iceslide_fem.run.own_point import own_history
from iceslide_fem.scene import Scene

# Columns of a history that are means over the contact, and those that switch within none of its
# rows' steps but at their ends; energies and water, which add up over it.
MEANS = (
    "mu", "film_height_m", "squeezed_height_m", "surface_temperature_C", "water_below_m3",
)  # fmt: skip
SWITCHES = ("melted_fraction", "saturated_fraction")
AMOUNTS = (
    "friction_work_J", "ice_heat_J", "rubber_heat_J", "latent_heat_J", "water_squeezed_m3",
)  # fmt: skip


def point_history(scene: Scene) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Run `scene` at its nominal pressure; rows of `history.csv` from t = 0, and the results.

    The rubber's length and width only turn stresses (Pa) into forces (N) and works (J/m2) into
    J; contact is complete. Ice that slides is run for the time that it is below the block, and the
    rows are the block's (`block_rows`). Raises SimulationStopped where the film cannot be advanced.
    """
    law = law_of(scene)
    rows, entries = _film_history(scene) if law is None else own_history(scene, law)
    if scene.ice.motion == "sliding":
        rows = block_rows(rows, scene)
        entries |= _mean_summary(rows)
    return rows, entries | {"energy_imbalance": rows[-1].energy_imbalance}


def _film_history(scene: Scene) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows and results of the film law at one point."""
    conditions = scene_conditions(scene)
    history = _History(scene, conditions)
    settings = simulation_settings(scene)
    duration = float(conditions.duration[0])

    with LongTask(duration, shown=rank() == 0) as shown:

        def observe(record: Record) -> None:
            history.add(record)
            row = history.rows[-1]
            where = f"t = {1e3 * row.time_s:.3f} of {1e3 * duration:g} ms"
            shown.show(row.time_s, where, f"mu {row.mu:.3f}", f"step {1e3 * row.step_s:.3g} ms")

        result = simulate(conditions, observe=observe, rubber=rubber_columns(scene), **settings)
    entries, rows = point_summary(result, 0), history.rows
    thinnest = min(row.film_height_m for row in rows)
    melts = entries["melt_onset_s"] is not None
    entries["warnings"] = doubts(thinnest, float(result.mu_peak[0]), melts)
    return rows, entries


def block_rows(rows: list[HistoryRow], scene: Scene) -> list[HistoryRow]:
    """The history of a block under which ice passes, from that of one point of the ice.

    By transit-time equivalence (docs/theory.md) ice at x from the leading edge has been below the
    block for x / v, or since t = 0 if that is less. So with T = L / v the block's mean of a value
    f of the point is (integral of f from 0 to t + (T - t) f(t)) / T up to T, and then constant.
    Energies Q become (2 integral of Q from 0 to t + (T - t) Q(t)) / T, and grow by Q(T) / T.
    """
    duration, transit = scene.load.duration, transit_time(scene)
    kind = type(rows[0])
    remembered = kind._fields[len(HistoryRow._fields) :]  # by the law
    table = {name: np.array(column, dtype=float) for name, column in _columns(rows).items()}
    time = table["time_s"]
    rest = np.maximum(transit - time, 0.0)
    whole = np.zeros_like(time)  # of mu: the work knows it better than its ends do
    speed = scene.load.speeds.first  # it does not change where ice passes below a point
    whole[1:] = table["friction_work_J"][1:] / (speed * table["normal_force_N"][1:])
    for name in (*MEANS, *remembered, *SWITCHES):
        values = table[name]
        if name != "mu":
            ends = values[:-1] if name in SWITCHES else 0.5 * (values[1:] + values[:-1])
            whole = np.concatenate([[0.0], np.cumsum(ends * np.diff(time))])
        table[name] = (whole + rest * values) / transit
    table["friction_force_N"] = table["mu"] * table["normal_force_N"]
    rates = {}
    for name in AMOUNTS:
        values = table[name]
        rates[name] = values[-1] / transit
        whole = cumulative_trapezoid(values, time, initial=0)
        table[name] = (2.0 * whole + rest * values) / transit
    table["water_left_m3"] = table["water_squeezed_m3"] - table["water_below_m3"]
    found = [kind(*values) for values in zip(*table.values(), strict=True)]
    left = duration - float(time[-1])
    if left > 1e-9 * duration:
        last = found[-1]._asdict()
        last |= {name: last[name] + left * rate for name, rate in rates.items()}
        slip = speed * duration
        last |= {"time_s": duration, "step_s": left, "slip_m": slip}
        last["water_left_m3"] = last["water_squeezed_m3"] - last["water_below_m3"]
        found.append(kind(**last))
    return [row._replace(energy_imbalance=_imbalance(row), newton_iterations=0) for row in found]


def _columns(rows: list[HistoryRow]) -> dict[str, tuple[float, ...]]:
    """Name -> values of the rows."""
    return dict(zip(rows[0]._fields, zip(*rows, strict=True), strict=True))


def _imbalance(row: HistoryRow) -> float:
    """Share of the friction work that is found nowhere."""
    found = row.ice_heat_J + row.rubber_heat_J + row.latent_heat_J
    return (row.friction_work_J - found) / row.friction_work_J if row.friction_work_J else 0.0


def _mean_summary(rows: list[HistoryRow]) -> dict[str, Any]:
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


class _History:
    """Rows of the history, one per accepted step from t = 0."""

    def __init__(self, scene: Scene, conditions: Conditions) -> None:
        self._scene = scene
        self._pressures, self._speeds = scene.load.pressures, scene.load.speeds
        self._area = scene.rubber.length * scene.rubber.width
        self._work = self._ice_heat = self._rubber_heat = self._latent_heat = 0.0
        shear = float(conditions.loads().viscous[0]) / scene.initial_height
        height, T_0 = scene.initial_height, scene.ice.temperature
        self.rows = [self._row(0.0, 0.0, shear, height, 0.0, T_0)]

    def add(self, record: Record) -> None:
        """Enter an accepted step."""
        step, dt = record.step, float(record.dt[0])
        self._work += self._area * float(step.friction_work[0])
        self._ice_heat += self._area * float(step.ice_heat[0])
        self._rubber_heat += self._area * float(step.rubber_heat[0])
        self._latent_heat += self._area * float(step.latent_heat[0])
        height = float(np.exp(step.state.log_height[0]))
        row = self._row(
            float(record.time[0]) + dt,
            dt,
            float(record.loads.viscous[0] * np.exp(log_shearing(step.state)[0])),
            height,
            float(step.state.squeezed_height[0]),
            float(record.ice.surface_temperature(step.state.ice)[0]),
            bool(record.melting[0]),
            bool(record.full[0]),
            float(np.exp(step.state.memory[0, 0])) if len(step.state.memory) else 1.0,
        )
        self.rows.append(row)

    def _row(
        self,
        time: float,
        dt: float,
        shear: float,
        height: float,
        squeezed: float,
        temperature: float,
        melting: bool = False,
        saturated: bool = False,
        thinned: float = 1.0,
    ) -> HistoryRow:
        """A row; `thinned`: the film's viscosity over that at the ice's initial temperature."""
        pressure = self._pressures.at(time)
        missing = self._work - self._ice_heat - self._rubber_heat - self._latent_heat
        row = HistoryRow(
            time_s=time,
            step_s=dt,
            slip_m=self._speeds.integral(time),
            mu=shear / pressure,
            film_height_m=height,
            squeezed_height_m=squeezed,
            surface_temperature_C=temperature - ZERO_CELSIUS,
            contact_fraction=1.0,
            nominal_pressure_Pa=pressure,
            speed_m_per_s=self._speeds.at(time),
            normal_force_N=pressure * self._area,
            friction_force_N=shear * self._area,
            plate_displacement_m=0.0,
            melted_fraction=float(melting),
            saturated_fraction=float(saturated),
            friction_work_J=self._work,
            load_work_J=0.0,
            ice_heat_J=self._ice_heat,
            rubber_heat_J=self._rubber_heat,
            latent_heat_J=self._latent_heat,
            wall_heat_J=0.0,
            elastic_energy_J=0.0,
            kinetic_energy_J=0.0,
            energy_imbalance=missing / self._work if self._work else 0.0,
            water_squeezed_m3=squeezed * self._area,
            water_below_m3=squeezed * self._area,
            water_left_m3=0.0,
            newton_iterations=0,
        )
        if self._scene.water.table is None:
            return row
        return row_of(row._asdict(), {FILM_VISCOSITY: thinned * self._scene.viscosity})


def point_doubts(conditions: Conditions, result: PointResult, number: int) -> list[str]:
    """Warnings of one of the conditions, for its summary: mu = k eta v / (p h) is largest where h
    is least.
    """
    mu = float(result.mu_peak[number])
    viscous = float(conditions.loads().viscous[number])
    thinnest = viscous / (mu * float(conditions.pressure[number]))
    return doubts(thinnest, mu, not np.isnan(result.melt_onset[number]))


def point_summary(result: PointResult, number: int) -> dict[str, Any]:
    """Entries of `summary.json` for one of the conditions, but for its energies."""

    def when(times: Array) -> float | None:
        return None if np.isnan(times[number]) else float(times[number])

    return {
        "mu_peak": float(result.mu_peak[number]),
        "mu_peak_time_s": float(result.mu_peak_time[number]),
        "mu_mean": float(result.mu_mean[number]),
        "mu_end": float(result.mu_end[number]),
        "melt_onset_s": when(result.melt_onset),
        "saturation_s": when(result.saturation),
        "steps": int(result.steps[number]),
        "rejected_steps": int(result.rejected[number]),
    }
