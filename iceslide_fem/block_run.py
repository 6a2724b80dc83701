"""One scene on the rungs with rubber: from the undeformed block to the end of its sliding."""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem._dolfinx import MPI
from iceslide_fem.block import Block, PathPoint, build_block, press, start_sliding
from iceslide_fem.checkpoint import Checkpoint, write_checkpoint
from iceslide_fem.errors import Interrupted, SimulationStopped
from iceslide_fem.history import (
    Ledger,
    Row,
    interface_fields,
    outside_table,
    preload_row,
    slide_row,
)
from iceslide_fem.ice import Continuum
from iceslide_fem.interruption import Interruption
from iceslide_fem.outputs import HISTORY_COLUMNS, PRELOAD_COLUMNS, Fields, Table
from iceslide_fem.progress import Progress
from iceslide_fem.scene import Scene
from iceslide_fem.sipes import smallest_opening
from iceslide_fem.sliding import Accepted, Sliding, place_at_start

FIELD_TIMES = 25


class Schedule(NamedTuple):
    """When checkpoints are written: every so many seconds of the clock, and after these times of
    the run (s)."""

    every: float = 60.0
    times: tuple[float, ...] = ()


def run_block(
    scene: Scene,
    out: Path,
    schedule: Schedule,
    resumed: Checkpoint | None,
) -> tuple[dict[str, Any], SimulationStopped | Interrupted | None]:
    """Run `scene` into `out`, from its beginning or from `resumed`. Collective.

    Returns the entries of its summary (none before sliding), and why it stopped early, if it did.
    """
    comm = MPI.COMM_WORLD
    results = Results()
    stopped: SimulationStopped | Interrupted | None = None
    with ExitStack() as open_files:
        interruption = open_files.enter_context(Interruption(comm))
        progress = open_files.enter_context(Progress(comm.rank, scene.load.duration))
        try:
            block = build_block(scene, comm)
            results.dofs = block.rubber.n_dofs
            state = resumed.state if resumed is not None else {}
            if state:
                place_at_start(block, state["sliding"])
            else:
                _bring_to_speed(block, out, results, progress, interruption)
            _slide(block, out, state, schedule, results, progress, interruption, open_files)
        except (SimulationStopped, Interrupted) as reason:
            stopped = reason
    return results.entries(), stopped


def _bring_to_speed(
    block: Block, out: Path, results: Results, progress: Progress, interruption: Interruption
) -> None:
    """Press the block and bring it to its speed; rows of `preload.csv`."""
    rank = block.surface.comm.rank
    if rank == 0:
        write_checkpoint(out, block.scene, {})  # to go on from means to begin, so far

    with Table(out / "preload.csv", PRELOAD_COLUMNS, rank) as preload:

        def observe(point: PathPoint) -> None:
            row = preload_row(block, point)
            preload.row(row)
            results.iterations += point.solution.iterations
            mu = row["friction_force_N"] / row["normal_force_N"]
            progress.update(0.0, mu, 0.0, point.solution.iterations, point.phase)
            if interruption.requested():
                raise interruption.error("before sliding", out)

        press(block, observe)
        start_sliding(block, observe)


def _slide(
    block: Block,
    out: Path,
    state: dict[str, Any],
    schedule: Schedule,
    results: Results,
    progress: Progress,
    interruption: Interruption,
    open_files: ExitStack,
) -> None:
    """Slide from t = 0, or from `state`, to the end; rows of `history.csv`, fields, checkpoints."""
    comm, duration = block.surface.comm, block.scene.load.duration
    sliding = Sliding(block)
    ledger = Ledger(sliding)
    ice = sliding.carrier.ice
    temperature = None
    if isinstance(ice, Continuum):
        temperature = ice.show(sliding.moment.interface.ice)
        results.dofs += ice.n_dofs
    if state:
        sliding.restore(state["sliding"])
        ledger.restore(state["ledger"])
        results.restore(state["results"])
    rows = len(results.rows) if state else None
    history = Table(out / "history.csv", HISTORY_COLUMNS, comm.rank, keep=rows)
    open_files.enter_context(history)
    earlier = state["fields"] if state else ()
    fields = Fields(out / "fields", block.rubber, block.surface, temperature, earlier)
    open_files.enter_context(fields)
    saves = _Saves(schedule, sliding.moment.time, comm)

    def save() -> None:
        history.secure()
        present = {
            "sliding": sliding.state(),
            "ledger": ledger.state(),
            "results": results.state(),
            "fields": fields.written,
        }
        if comm.rank == 0:
            write_checkpoint(out, block.scene, present)

    def note(accepted: Accepted | None) -> Row:
        row = slide_row(sliding, ledger, accepted)
        history.row(row)
        results.note(row, accepted.rejected if accepted else 0)
        results.outside_table_fraction = outside_table(block, sliding.moment.contact)
        results.sipe_opening = min(results.sipe_opening, smallest_opening(block))
        return row

    if not state:
        fields.write(0.0, interface_fields(sliding, None))
        note(None)
        save()
    due = FieldTimes(duration, sliding.moment.time)
    while sliding.moment.time < duration:
        accepted = sliding.advance()
        time = sliding.moment.time
        ledger.add(accepted)
        row = note(accepted)
        if due(time):
            if isinstance(ice, Continuum):
                ice.show(sliding.moment.interface.ice)
            fields.write(time, interface_fields(sliding, accepted))
        progress.update(time, row["mu"], accepted.dt, accepted.iterations, "sliding")
        asked = interruption.requested()
        if saves.due(time) or asked:
            save()
        if asked:
            where = f"at t = {1e3 * time:.4g} ms of {1e3 * duration:.4g} ms"
            raise interruption.error(where, out)


class _Saves:
    """Says after which steps a checkpoint is due."""

    def __init__(self, schedule: Schedule, time: float, comm: MPI.Comm) -> None:
        self._every, self._comm, self._last = schedule.every, comm, monotonic()
        self._times = sorted(at for at in schedule.times if at > time)

    def due(self, time: float) -> bool:
        """Whether one is due at `time` (s). Collective: rank 0's clock decides."""
        passed = [at for at in self._times if at <= time]
        self._times = self._times[len(passed) :]
        late = self._comm.bcast(monotonic() - self._last >= self._every)
        if passed or late:
            self._last = monotonic()
        return bool(passed) or late


class FieldTimes:
    """Says after which steps fields are written: the first one in each of `FIELD_TIMES` parts."""

    def __init__(self, duration: float, time: float) -> None:
        """`time` (s) is that of the last step done."""
        self._duration = duration
        self._part = self._part_of(time)

    def __call__(self, time: float) -> bool:
        """Whether fields are due at `time` (s)."""
        before, self._part = self._part, self._part_of(time)
        return self._part > before

    def _part_of(self, time: float) -> int:
        return int(FIELD_TIMES * time / self._duration)


class Results:
    """What the summary says of a history, collected row by row."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float]] = []
        self.melt_onset: float | None = None
        self.saturation: float | None = None
        self.rejected = self.iterations = self.dofs = 0
        self.imbalance = 0.0
        self.outside_table_fraction = 0.0
        self.sipe_opening = math.inf

    def note(self, row: dict[str, Any], rejected: int) -> None:
        """Enter a row of the history, and how many steps were rejected before it."""
        self.rows.append((row["time_s"], row["mu"]))
        self.rejected += rejected
        self.iterations += row["newton_iterations"]
        self.imbalance = row["energy_imbalance"]
        if self.melt_onset is None and row["melted_fraction"] > 0.0:
            self.melt_onset = row["time_s"]
        if self.saturation is None and row["saturated_fraction"] > 0.0:
            self.saturation = row["time_s"]

    def state(self) -> dict[str, Any]:
        """Everything collected so far."""
        return vars(self).copy()

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from what was collected."""
        vars(self).update(state, rows=[tuple(row) for row in state["rows"]])

    def entries(self) -> dict[str, Any]:
        """Entries of `summary.json` that follow from the history; none if it has no row."""
        if not self.rows:
            return {}
        time, mu = np.array(self.rows).T
        peak = int(mu.argmax())
        span = time[-1] - time[0]
        return {
            "mu_peak": float(mu[peak]),
            "mu_peak_time_s": float(time[peak]),
            "mu_mean": float(trapezoid(mu, time) / span) if span > 0.0 else float(mu[0]),
            "mu_end": float(mu[-1]),
            "melt_onset_s": self.melt_onset,
            "saturation_s": self.saturation,
            "steps": len(self.rows) - 1,
            "rejected_steps": self.rejected,
            "newton_iterations": self.iterations,
            "dofs": self.dofs,
            "energy_imbalance": self.imbalance,
            "outside_table_fraction": self.outside_table_fraction,
            "sipe_opening_m": self.sipe_opening if math.isfinite(self.sipe_opening) else None,
        }
