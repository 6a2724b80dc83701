"""A point of sliding ice below rubber whose contact ages: ice that enters later meets older rubber.

Below a block ice has entered at different times e, and has been there for s. A value of it is
F(e, s). With the transit time T = L / v the block's mean at the time t is

    (1/T) [integral of F(t - s, s) ds from 0 to min(t, T) + max(T - t, 0) F(0, t)],

because ice that is there at t = 0 has entered then. Energies Q(e, s) sum to

    (1/T) [integral of Q(e, min(t - e, T)) de from 0 to t + integral of Q(0, min(t, s)) ds, 0 to T].

F is computed for a few entries and interpolated linearly in ln e.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem.film.conditions import exposure, transit_time
from iceslide_fem.film.point_result import PointResult
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.output.water import AMOUNTS as WATER_AMOUNTS
from iceslide_fem.runs.point_pass import first_state, ice_of, imbalance, one_pass
from iceslide_fem.runs.point_passes import AMOUNTS, MEANS, SWITCHES, left_behind
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene

FIRST, RATIO = 1 / 64, 2.0  # first entry over the transit time, and ratio of the following ones
LATER = 12  # rows for each doubling of the time behind the transit


def entries_of(transit: float, duration: float) -> Array:
    """Times (s) at which ice enters, from 0 to the end of the run."""
    count = int(np.ceil(np.log(max(duration / (FIRST * transit), 1.0)) / np.log(RATIO)))
    return np.append(0.0, np.minimum(FIRST * transit * RATIO ** np.arange(count + 1), duration))


class Entering:
    """Values of ice over its entry e and its time s below the rubber, from the rows of each."""

    def __init__(self, entries: Array, histories: list[list[HistoryRow]]) -> None:
        self._log = np.log(entries + entries[1])
        self.time = np.array([row.time_s for row in histories[0]])
        columns = histories[0][0]._fields
        self._values = {}
        for name in columns:
            rows = [
                np.interp(
                    self.time,
                    [row.time_s for row in history],
                    [float(getattr(row, name)) for row in history],
                )
                for history in histories
            ]
            self._values[name] = np.array(rows)
        self._first = float(entries[1])

    def at(self, name: str, entry: Array, time: Array) -> Array:
        """Values of a column for an `entry` (s), after a `time` (s), (n,)."""
        values, log = self._values[name], np.log(np.maximum(entry, 0.0) + self._first)
        below = np.clip(np.searchsorted(self._log, log, side="right") - 1, 0, self._log.size - 2)
        part = (log - self._log[below]) / (self._log[below + 1] - self._log[below])
        place = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 2)
        run = self.time[place + 1] - self.time[place]
        along = np.clip((time - self.time[place]) / run, 0.0, 1.0)
        ends = [
            values[row, place] + along * (values[row, place + 1] - values[row, place])
            for row in (below, below + 1)
        ]
        return np.asarray(ends[0] + np.clip(part, 0.0, 1.0) * (ends[1] - ends[0]))

    def mean(self, name: str, time: float, transit: float) -> float:
        """The block's mean of a column at a `time` (s)."""
        s = np.append(self.time[self.time < time], min(time, transit))
        values = self.at(name, time - s, s)
        rest = max(transit - time, 0.0)
        young = float(self.at(name, np.zeros(1), np.array([min(time, transit)]))[0])
        return float((trapezoid(values, s) + rest * young) / transit)

    def amount(self, name: str, time: float, transit: float) -> float:
        """The block's sum of an energy or of water until a `time` (s)."""
        s = np.append(self.time[self.time < time], min(time, transit))
        leaving = trapezoid(self.at(name, np.zeros(s.size), s), s)
        leaving += max(transit - time, 0.0) * self.at(name, np.zeros(1), s[-1:])[0]
        below = trapezoid(self.at(name, time - s, s), s)
        entered = np.linspace(0.0, max(time - transit, 0.0), 60)
        passed = trapezoid(self.at(name, entered, np.full(60, transit)), entered)
        return float((leaving + below + passed) / transit)


def rows_over_ageing(scene: Scene, law: InterfaceLaw) -> tuple[list[HistoryRow], PointResult]:
    """Rows of the block, and the result of the ice that is there at t = 0.

    Raises SimulationStopped.
    """
    transit, duration, ice = transit_time(scene), scene.load.duration, ice_of(scene)
    entries, histories, results = entries_of(transit, duration), [], []
    pressure = np.full(1, scene.load.pressures.first)
    for entry in entries:
        start = first_state(scene, law, ice)
        age = law.aged(start.age, pressure, pressure, float(entry), None)
        rows, result = one_pass(scene, law, ice, start._replace(age=age), shown=False)
        histories.append(rows)
        results.append(result)
    found = Entering(entries, histories)
    times = found.time
    if duration > transit:
        count = max(2, int(np.ceil(LATER * np.log2(duration / transit))))
        times = np.append(times, np.geomspace(exposure(scene), duration, count)[1:])
    kind, load = type(histories[0][0]), scene.load
    reported = kind._fields[len(HistoryRow._fields) :]
    amounts = (*AMOUNTS, *(name for name in reported if name in WATER_AMOUNTS))
    means = (*MEANS, *SWITCHES, *(name for name in reported if name not in WATER_AMOUNTS))
    block, before = [], 0.0
    for t in times.tolist():
        values = histories[0][0]._asdict() | {
            "time_s": t,
            "step_s": t - before,
            "slip_m": load.speeds.integral(t),
        }
        values |= {name: found.mean(name, t, transit) for name in means}
        values |= {name: found.amount(name, t, transit) for name in amounts}
        values["friction_force_N"] = values["mu"] * values["normal_force_N"]
        values["water_left_m3"] = left_behind(values)
        row = kind(**values)
        missing = imbalance(row, scene.ice.solid)
        block.append(row._replace(energy_imbalance=missing, newton_iterations=0))
        before = t
    return block, results[0]
