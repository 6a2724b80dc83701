"""Writes `passes.csv` while a block slides over the same ice several times."""

from __future__ import annotations

import math
from typing import Any

from iceslide_fem.output.passes import PassRow
from iceslide_fem.output.table import Table
from iceslide_fem.runs.observation import Observation
from iceslide_fem.runs.summary import Results
from iceslide_fem.scene.load import Load


class PassSeries:
    """A row for each pass, at its end."""

    def __init__(
        self, table: Table | None, load: Load, results: Results, earlier: dict[str, Any]
    ) -> None:
        """table: None for one pass; results: receive the means; earlier: `state` to continue, or
        empty.
        """
        self._table, self._load, self._results = table, load, results
        self._now: dict[str, Any] = {"written": 0} | earlier

    def state(self) -> dict[str, Any]:
        """Sums of the present pass, and number of rows written."""
        return dict(self._now)

    def __call__(self, step: Observation) -> None:
        """Add an observation; write a row at the end of a pass."""
        if self._table is None:
            return
        now, row, number = self._now, step.row, step.sliding.number
        begins = (number - 1) * self._load.duration
        if step.accepted is None:
            now |= {
                "surface": row.surface_temperature_C, "time": row.time_s, "mu": row.mu,
                "sum": 0.0, "peak": row.mu, "onset": math.nan, "steps": 0, "rejected": 0,
            }  # fmt: skip
            return
        now["sum"] += 0.5 * (row.mu + now["mu"]) * (row.time_s - now["time"])
        now["peak"], now["steps"] = max(now["peak"], row.mu), now["steps"] + 1
        now["time"], now["mu"] = row.time_s, row.mu
        now["rejected"] += step.accepted.rejected
        if math.isnan(now["onset"]) and row.melted_fraction > 0.0:
            now["onset"] = row.time_s - begins
        if row.time_s < begins + self._load.duration:
            return
        self._table.row(
            PassRow(
                number,
                begins + (number - 1) * self._load.rest,
                now["sum"] / self._load.duration,
                now["peak"],
                row.mu,
                now["onset"],
                now["surface"],
                row.surface_temperature_C,
                math.nan,
                row.film_height_m,
                row.squeezed_height_m,
                row.friction_work_J,
                now["steps"],
                now["rejected"],
            )
        )
        now["written"] += 1
        self._results.passes, self._results.last_pass = number, now["sum"] / self._load.duration
