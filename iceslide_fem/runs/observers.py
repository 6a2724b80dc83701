"""Observers of a sliding block: each is called at t = 0 and after every accepted step.

All are collective. They do not change the simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.output.block_fields import BlockFields
from iceslide_fem.output.fields import Fields
from iceslide_fem.output.probes import Probes
from iceslide_fem.output.summary import Log
from iceslide_fem.output.table import PassRow, Table
from iceslide_fem.runs.checkpoint import write_checkpoint
from iceslide_fem.runs.interruption import Interruption
from iceslide_fem.runs.pace import Observation, TimeLimit
from iceslide_fem.runs.schedule import FieldTimes, Saves, Schedule
from iceslide_fem.runs.summary import Results
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.scene.load import Load


class Progress(LongTask):
    """Context manager that shows the progress of a run of `total_time` (s, simulated).

    Only rank 0 shows it. Under mpirun standard error is no terminal, so lines are printed.
    """

    def __init__(self, comm_rank: int, total_time: float) -> None:
        super().__init__(total_time, comm_rank == 0)

    def __call__(self, step: Observation) -> None:
        """Show t = 0 or an accepted step of sliding."""
        row = step.row
        self.update(row.time_s, row.mu, row.step_s, row.newton_iterations, "sliding")

    def update(self, time: float, mu: float, step: float, newton: int, text: str = "") -> None:
        """Show an accepted step: its end `time` and length `step` (s), friction coefficient `mu`,
        number of `newton` iterations, and `text` such as the name of the phase.
        """
        where = f"t = {1e3 * time:.3f} of {1e3 * self.total:g} ms"
        words = f"mu {mu:.3f}", f"step {1e3 * step:.3g} ms", f"{newton} Newton", text
        self.show(time, where, *words)


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


# Is given a row that has been written; whether the run should go on (None: yes).
Tell = Callable[[Mapping[str, Any]], bool | None]


class Watch(NamedTuple):
    """Services of a run from its first equilibrium to its last step, and its folder."""

    out: Path
    schedule: Schedule
    results: Results
    progress: Progress
    interruption: Interruption
    log: Log
    limit: TimeLimit
    caller: Tell | None = None

    def tell(self, row: NamedTuple) -> None:
        """Give the caller a `row` that has been written; its False is a request to stop."""
        if self.caller is None:
            return
        goes_on = self.caller(row._asdict())
        if goes_on is not None and not goes_on:
            self.interruption.ask()


class FieldSeries:
    """Writes `fields/` at the scheduled times."""

    def __init__(
        self, folder: Path, sliding: Sliding, earlier: Sequence[Mapping[str, Any]], log: Log
    ) -> None:
        """`earlier`: `state` of the run to continue."""
        scene, self._log = sliding.block.scene, log
        self._fields = BlockFields(sliding, scene.output.fields)
        self._files = Fields(folder, sliding.block.surface.comm, earlier)
        since = sliding.current.time if earlier else None
        self._due = FieldTimes(scene.output.times, scene.load.sliding_time, since)

    def state(self) -> list[dict[str, Any]]:
        """Times and files written so far."""
        return self._files.written

    def __call__(self, step: Observation) -> None:
        """Write the fields if a time is reached."""
        if self._due(step.time) and (grids := self._fields.grids(step.accepted)):
            self._files.write(step.time, grids)
            self._log("fields", time_s=step.time)


class ProbeSeries:
    """Writes a row for each probe, if there are any."""

    def __init__(self, table: Table | None, probes: Probes, written: int) -> None:
        """table: None without probes; written: `state` of the run to continue."""
        self._table, self._probes, self._written = table, probes, written

    def state(self) -> int:
        """Rows written so far."""
        return self._written

    def __call__(self, step: Observation) -> None:
        """Write a row for each probe."""
        if self._table is None:
            return
        for row in self._probes.rows(step.sliding, step.accepted):
            self._table.row(row)
        self._written += len(self._probes)


class Checkpoints:
    """Writes checkpoints at the scheduled times; `save` writes one immediately."""

    def __init__(
        self,
        folder: Path,
        sliding: Sliding,
        parts: Mapping[str, Callable[[], Any]],
        tables: Sequence[Table],
        watch: Watch,
    ) -> None:
        """parts: functions that return parts of a checkpoint by name; tables: flushed before.

        Parts are JSON values and this rank's arrays.
        """
        self._folder, self._sliding, self._parts = folder, sliding, parts
        self._tables, self._comm, self._log = tables, sliding.block.surface.comm, watch.log
        self._due = Saves(watch.schedule, sliding.current.time, self._comm)

    def __call__(self, step: Observation) -> None:
        """Save at scheduled times, at t = 0 and at the end."""
        ends = step.time >= self._sliding.block.scene.load.sliding_time
        if self._due(step.time) or step.accepted is None or ends:
            self.save()

    def save(self) -> None:
        """Write a checkpoint of the present state."""
        for table in self._tables:
            table.secure()
        present = {name: state() for name, state in self._parts.items()}
        write_checkpoint(self._folder, self._sliding.block.scene, present, self._comm)
        self._log("checkpoint", time_s=self._sliding.current.time)


class Stops:
    """Stops a run on request or at its time limit, with a checkpoint of the last accepted step."""

    def __init__(self, sliding: Sliding, checkpoints: Checkpoints, watch: Watch) -> None:
        self._sliding, self._checkpoints, self._watch = sliding, checkpoints, watch

    def __call__(self, step: Observation) -> None:
        """Raise Interrupted after a signal, SimulationStopped at the time limit."""
        if step.time < step.sliding.block.scene.load.sliding_time:
            self._heed()

    def refused(self, dt: float, reason: Exception) -> None:
        """Log a rejected trial step of `dt` (s), and handle a signal before the next one."""
        time = self._sliding.current.time
        self._watch.log("refused", time_s=time, step_s=dt, reason=str(reason))
        self._heed()

    def _heed(self) -> None:
        watch, moment = self._watch, self._sliding.moment
        if watch.interruption.requested():
            self._checkpoints.save()
            raise watch.interruption.error(f"at {moment}", watch.out)
        why = watch.limit.over()
        if why:
            self._checkpoints.save()
            raise SimulationStopped(f"the run stops at {moment}: {why}")
