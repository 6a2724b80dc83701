"""Run a scene from start to end and write what it gives: the entry point of cases and commands."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np

import iceslide_fem
from iceslide_fem.errors import SceneError
from iceslide_fem.files import writing
from iceslide_fem.output.summary import begin_run, write_summary
from iceslide_fem.output.table import HistoryRow, Table
from iceslide_fem.planning.rungs import resolved
from iceslide_fem.results import Run, read_run
from iceslide_fem.results.report import report
from iceslide_fem.run.checkpoint import FILE as CHECKPOINT
from iceslide_fem.run.checkpoint import Checkpoint
from iceslide_fem.scene import Scene
from iceslide_fem.scene.notes import notes

if TYPE_CHECKING:
    from iceslide_fem.run.block import Schedule


def run(
    scene: Scene,
    out: Path | str,
    petsc_options: Sequence[str] = (),
    schedule: Schedule | None = None,
    resumed: Checkpoint | None = None,
) -> dict[str, Any]:
    """Run `scene`, write histories, summary, fields and report to `out`, return the summary.

    Collective over all ranks of COMM_WORLD. `petsc_options` are words as on PETSc's command line;
    `schedule` says when a slice or block leaves checkpoints, and `resumed` is the one in `out` that
    it goes on from. Raises SimulationStopped where the run cannot go on, Interrupted where it was
    asked to stop, OutputError where it cannot write; what was accepted is written.
    """
    scene = resolved(scene)
    out = Path(out)
    if scene.model == "point":
        return _run_point(scene, out)

    from iceslide_fem.fenics.compat import MPI, PETSc
    from iceslide_fem.run.block import run_block
    from iceslide_fem.run.schedule import Schedule

    PETSc.Options().insertString(" ".join(petsc_options))
    started = monotonic()
    entries, stopped = run_block(scene, out, schedule or Schedule(), resumed)
    comm = MPI.COMM_WORLD
    summary = _summary(scene, entries, started)
    summary["ranks"] = comm.size
    summary["stopped"] = str(stopped) if stopped else None
    if entries:
        _finish(out, summary, comm.rank)
    if stopped:
        raise stopped
    if comm.rank == 0:  # only now: until everything is written, a kill must leave a way on
        (out / CHECKPOINT).unlink(missing_ok=True)
    return summary


def kept_run(scene: Scene, directory: Path | str) -> Run:
    """The run of exactly this scene in `directory`: the whole one that is there, or made now."""
    try:
        kept = read_run(directory)
    except SceneError:
        kept = None
    if kept is None or kept.summary.get("stopped") or kept.scene != scene.as_dict():
        run(scene, directory)
        kept = read_run(directory)
    return kept


def _run_point(scene: Scene, out: Path) -> dict[str, Any]:
    from iceslide_fem.fenics.compat import MPI
    from iceslide_fem.run.point import point_history

    started = monotonic()
    rows, results = point_history(scene)
    summary = _summary(scene, results, started)
    rank = MPI.COMM_WORLD.rank
    begin_run(out, rank)
    with Table(out / "history.csv", HistoryRow, rank) as history:
        for row in rows:
            history.row(row)
    _finish(out, summary, rank)
    return summary


def _summary(scene: Scene, results: dict[str, Any], started: float) -> dict[str, Any]:
    from iceslide_fem.fenics.compat import VERSION, PETSc

    versions = {
        "iceslide_fem": iceslide_fem.__version__,
        "dolfinx": VERSION,
        "petsc": ".".join(str(part) for part in PETSc.Sys.getVersion()),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    wall = {"wall_s": monotonic() - started}
    warnings = [*notes(scene), *results.pop("warnings", [])]
    described = {"warnings": warnings, "versions": versions, "scene": scene.as_dict()}
    return {**results, **wall, **described}


def _finish(out: Path, summary: dict[str, Any], rank: int) -> None:
    if rank == 0:
        write_summary(out / "summary.json", summary)
        with writing(out / "report.png"):
            report(out)
