"""Run a scene from start to end and write what it gives: the entry point of cases and commands."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

import iceslide_fem
from iceslide_fem.errors import SceneError, SimulationStopped
from iceslide_fem.neglect import resolved
from iceslide_fem.outputs import HISTORY_COLUMNS, PRELOAD_COLUMNS, Fields, Table, write_summary
from iceslide_fem.progress import Progress
from iceslide_fem.report import report
from iceslide_fem.results import Run, read_run
from iceslide_fem.scene import Scene

FIELD_TIMES = 25


def run(scene: Scene, out: Path | str, petsc_options: Sequence[str] = ()) -> dict[str, Any]:
    """Run `scene`, write histories, summary, fields and report to `out`, return the summary.

    Collective over all ranks of COMM_WORLD. `petsc_options` are words as on PETSc's command
    line. Raises SimulationStopped where the run cannot go on; what was accepted is written.
    """
    scene = resolved(scene)
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    if scene.model == "point":
        return _run_point(scene, out)
    return _run_block(scene, out, petsc_options)


def kept_run(scene: Scene, directory: Path | str) -> Run:
    """The run of exactly this scene in `directory`: the one that is there, or made now."""
    try:
        kept = read_run(directory)
    except SceneError:
        kept = None
    if kept is None or kept.scene != scene.as_dict():
        run(scene, directory)
        kept = read_run(directory)
    return kept


def _run_point(scene: Scene, out: Path) -> dict[str, Any]:
    from iceslide_fem._dolfinx import MPI
    from iceslide_fem.point_run import point_history

    started = monotonic()
    rows, results = point_history(scene)
    summary = _summary(scene, results, started)
    rank = MPI.COMM_WORLD.rank
    with Table(out / "history.csv", HISTORY_COLUMNS, rank) as history:
        for row in rows:
            history.row(row)
    _finish(out, summary, rank)
    return summary


def _run_block(scene: Scene, out: Path, petsc_options: Sequence[str]) -> dict[str, Any]:
    from iceslide_fem._dolfinx import MPI, PETSc
    from iceslide_fem.block import PathPoint, build_block, press, start_sliding
    from iceslide_fem.history import Ledger, interface_fields, outside_table, preload_row, slide_row
    from iceslide_fem.ice import Continuum
    from iceslide_fem.sipes import smallest_opening
    from iceslide_fem.sliding import Sliding

    PETSc.Options().insertString(" ".join(petsc_options))
    comm = MPI.COMM_WORLD
    started = monotonic()
    results = Results(scene.load.duration)
    stopped: SimulationStopped | None = None
    with ExitStack() as open_files:
        progress = open_files.enter_context(Progress(comm.rank, scene.load.duration))
        preload = open_files.enter_context(Table(out / "preload.csv", PRELOAD_COLUMNS, comm.rank))
        history = open_files.enter_context(Table(out / "history.csv", HISTORY_COLUMNS, comm.rank))
        block = build_block(scene, comm)
        results.dofs = block.rubber.n_dofs

        def observe(point: PathPoint) -> None:
            row = preload_row(block, point)
            preload.row(row)
            results.iterations += point.solution.iterations
            mu = row["friction_force_N"] / row["normal_force_N"]
            progress.update(0.0, mu, 0.0, point.solution.iterations, point.phase)

        try:
            press(block, observe)
            start_sliding(block, observe)
            sliding = Sliding(block)
            temperature = None
            ice = sliding.carrier.ice
            if isinstance(ice, Continuum):
                temperature = ice.show(sliding.moment.interface.ice)
                results.dofs += ice.n_dofs
            fields = Fields(out / "fields", block.rubber, block.surface, temperature)
            open_files.callback(fields.close)
            fields.write(0.0, interface_fields(sliding, None))
            ledger = Ledger(sliding)
            row = slide_row(sliding, ledger, None)
            history.row(row)
            results.note(row, 0)
            due = FieldTimes(scene.load.duration)
            while sliding.moment.time < scene.load.duration:
                accepted = sliding.advance()
                ledger.add(accepted)
                row = slide_row(sliding, ledger, accepted)
                history.row(row)
                results.note(row, accepted.rejected)
                if due(sliding.moment.time):
                    results.sipe_opening = min(results.sipe_opening, smallest_opening(block))
                    if isinstance(ice, Continuum):
                        ice.show(sliding.moment.interface.ice)
                    fields.write(sliding.moment.time, interface_fields(sliding, accepted))
                progress.update(
                    sliding.moment.time, row["mu"], accepted.dt, accepted.iterations, "sliding"
                )
            results.outside_table_fraction = outside_table(block, sliding.moment.contact)
        except SimulationStopped as reason:
            stopped = reason
    summary = _summary(scene, results.entries(), started)
    summary["ranks"] = comm.size
    summary["stopped"] = str(stopped) if stopped else None
    if results.rows:
        _finish(out, summary, comm.rank)
    if stopped:
        raise stopped
    return summary


class FieldTimes:
    """Says after which steps fields are written: the first one in each of `FIELD_TIMES` parts."""

    def __init__(self, duration: float) -> None:
        self._duration, self._written = duration, 0

    def __call__(self, time: float) -> bool:
        """Whether fields are due at `time` (s)."""
        part = int(FIELD_TIMES * time / self._duration)
        due = part > self._written
        self._written = part
        return due


class Results:
    """What the summary says of a history, collected row by row."""

    def __init__(self, duration: float) -> None:
        self.duration = duration
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

    def entries(self) -> dict[str, Any]:
        """Entries of `summary.json` that follow from the history."""
        if not self.rows:
            return {"newton_iterations": self.iterations, "dofs": self.dofs}
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


def _summary(scene: Scene, results: dict[str, Any], started: float) -> dict[str, Any]:
    from iceslide_fem._dolfinx import VERSION, PETSc

    versions = {
        "iceslide_fem": iceslide_fem.__version__,
        "dolfinx": VERSION,
        "petsc": ".".join(str(part) for part in PETSc.Sys.getVersion()),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    wall = {"wall_s": monotonic() - started}
    return {**results, **wall, "versions": versions, "scene": scene.as_dict()}


def _finish(out: Path, summary: dict[str, Any], rank: int) -> None:
    if rank == 0:
        write_summary(out / "summary.json", summary)
        report(out)
