"""Writes `passes.csv` while a block slides over the same ice several times."""

from __future__ import annotations

import math
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.output.passes import PassRow
from iceslide_fem.output.table import Table
from iceslide_fem.run.observation import Observation
from iceslide_fem.run.summary import Results


class PassSeries:
    """A row for each pass, at its end; a context manager, which closes the table."""

    def __init__(
        self, path: Path, sliding: Sliding, results: Results, earlier: dict[str, Any] | None
    ) -> None:
        """`results` are told the means; `earlier` is the `state` of the run that goes on."""
        self._results = results
        scene, rank = sliding.block.scene, sliding.block.surface.comm.rank
        self._load = scene.load
        self._now: dict[str, Any] = dict(earlier or {"written": 0})
        written = self._now["written"] or None
        self._table = Table(path, PassRow, rank, written) if scene.load.passes > 1 else None

    def state(self) -> dict[str, Any]:
        """What this pass has come to, and how many rows are written."""
        return dict(self._now)

    def secure(self) -> None:
        """Return when all rows are on the disk."""
        if self._table is not None:
            self._table.secure()

    def __call__(self, step: Observation) -> None:
        """Enter a moment of a pass; write its row at its end."""
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

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._table is not None:
            self._table.close()
