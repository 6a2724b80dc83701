"""Run a scene from start to end and write its results: the entry point of cases and commands."""

from __future__ import annotations

import functools
import json
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from iceslide_fem.output.summary import write_summary
from iceslide_fem.output.table import PassRow, Table
from iceslide_fem.postprocess.report.curves import draw_run
from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.runs.checkpoint import FILE as CHECKPOINT
from iceslide_fem.runs.checkpoint import Checkpoint, finish
from iceslide_fem.runs.doubts import before_run
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runs.verdict import verdict
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import writing
from iceslide_fem.runtime.folders import claimed, clear_results, results_in
from iceslide_fem.runtime.launch import imports_that_stay, started_by_mpirun
from iceslide_fem.runtime.ranks import arrive, from_root
from iceslide_fem.scene import Scene, flat
from iceslide_fem.scene.fingerprint import fingerprint, scene_hash, versions
from iceslide_fem.scene.model import FILE_KEYS

if TYPE_CHECKING:
    from mpi4py import MPI

    from iceslide_fem.runs.observers import Tell
    from iceslide_fem.runs.schedule import Schedule

_FILES = [".".join(place) for place in FILE_KEYS]  # their content counts, by `scene_hash`
_OWN_RUNS = "run(..., comm=MPI.COMM_SELF) is a run of one rank alone"
_one_at_a_time = threading.RLock()  # PETSc serves one thread
# Files of a run that has not yet reached sliding; they may be replaced.
_WITHOUT_ROWS = {CHECKPOINT, "history.csv", "preload.csv", "stopped.txt", "log.jsonl", "fields"}
_WITHOUT_ROWS |= {"report.html"}  # it reports this state


def run(
    scene: Scene,
    out: Path | str,
    petsc_options: Sequence[str] = (),
    schedule: Schedule | None = None,
    resumed: Checkpoint | None = None,
    force: bool = False,
    pictures: bool = True,
    comm: MPI.Comm | None = None,
    progress: Tell | None = None,
) -> dict[str, Any]:
    """Run `scene`, write histories, summary, fields and report to `out`, return the summary.

    Collective over the ranks of `comm`, else of COMM_WORLD; if one rank fails alone, all ranks end.
    Runs of several threads wait for each other. petsc_options: words as on PETSc's command line;
    schedule: times of checkpoints of a slice or block; resumed: checkpoint in `out` to continue
    from; force: replace results in `out` of another scene or an unfinished run; pictures: draw the
    report; progress: is given every row of a slice or block, and stops the run by False. Raises
    SceneError if it may not write to `out` or its ranks were given different runs,
    SimulationStopped if the run cannot continue, Interrupted after a request to stop, OutputError
    if it cannot write. Accepted steps are always written.
    """
    out = Path(out)
    with _one_at_a_time:
        comm = _world() if comm is None else comm
        _check_same_run(scene, out, comm)
        scene = resolved(scene)
        if scene.model == "point":
            return _run_point(scene, out, force, pictures, comm)
        run = functools.partial(_run_block, scene, out, petsc_options, schedule, resumed)
        return run(force, pictures, comm, progress)


def _check_same_run(scene: Scene, out: Path, comm: MPI.Comm | None) -> None:
    """Raise SceneError on all ranks unless they were given one scene and folder. Collective."""
    if comm is None or comm.size == 1:
        return
    arrive(comm, f"all ranks of one communicator take part in a run; {_OWN_RUNS}")
    given = comm.allgather((scene, str(out.absolute())))
    first, folder = given[0]
    for rank, (other, there) in enumerate(given):
        apart = difference(first, other.as_dict())
        if folder != there:
            apart = apart or f"the folder is {there} there and {folder} here"
        if apart:
            raise SceneError(
                f"ranks 0 and {rank} were given different runs ({apart}): all ranks of one "
                f"communicator take the same scene and folder; {_OWN_RUNS}"
            )


def kept_run(scene: Scene, directory: Path | str) -> Run:
    """The complete run of this scene by this program version in `directory`; run it if missing."""
    try:
        kept = read_run(directory)
    except SceneError:
        kept = None
    known = kept is not None and kept.summary.get("fingerprint") == fingerprint(resolved(scene))
    if kept is None or not known or kept.summary.get("stopped"):
        run(scene, directory, force=True)
        kept = read_run(directory)
    return kept


def difference(scene: Scene, there: Mapping[str, Any], free: Sequence[str] = ()) -> str:
    """The first key, not in `free`, in which `scene` differs from that of a summary; or ""."""
    here, known = flat(scene.as_dict()), flat(there)
    keys = [key for key in {**here, **known} if here.get(key) != known.get(key)]
    changed = [key for key in keys if key not in free]
    if not changed:
        return ""
    key = changed[0]
    return f"{key} is {known.get(key)} there and {here.get(key)} here"


def other_results(scene: Scene, out: Path) -> str | None:
    """Description of results in `out`; None for a finished run of this scene, or no results."""
    history = out / "history.csv"
    rows = history.read_bytes().count(b"\n") - 1 if history.is_file() else 0
    if rows < 1 and not (out / "summary.json").is_file():
        begun = {path.name for path in results_in(out)} <= _WITHOUT_ROWS
        return None if begun else "results of another command, or of a run that is not whole"
    if (out / CHECKPOINT).is_file():
        return f"a run that has not finished ({rows} rows): iceslide run --restart {out} goes on"
    try:
        summary = json.loads((out / "summary.json").read_bytes())
        changed = difference(scene, summary["scene"], _FILES)
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return "results of another command, or of a run that is not whole"
    if changed:
        return f"a run of another scene ({changed})"
    if summary.get("scene_hash", scene_hash(scene)) != scene_hash(scene):
        return "a run of another mesh or contact table under the same name"
    return None


def _run_block(
    scene: Scene,
    out: Path,
    petsc_options: Sequence[str],
    schedule: Schedule | None,
    resumed: Checkpoint | None,
    force: bool,
    pictures: bool,
    comm: MPI.Comm | None,
    progress: Tell | None,
) -> dict[str, Any]:
    from iceslide_fem.fenics.start import options_without_effect, start_petsc

    start_petsc(petsc_options, comm)
    with imports_that_stay():
        from iceslide_fem.fenics.compat import MPI
        from iceslide_fem.runs.block import run_block
        from iceslide_fem.runs.schedule import Schedule

    comm = MPI.COMM_WORLD if comm is None else comm
    with _alone_in(out, scene, force, resumed, comm):
        started = monotonic()
        entries, stopped = run_block(scene, out, schedule or Schedule(), resumed, comm, progress)
        summary = _summary(scene, entries, started)
        summary["ranks"] = comm.size
        summary["stopped"] = str(stopped) if stopped else None
        if entries:
            from_root(functools.partial(_finish, out, summary, pictures), comm)
        if comm.rank == 0:
            for name in options_without_effect(petsc_options):
                print(f"Note: PETSc has not asked for the option {name}: it has no effect.")
        if stopped:
            raise stopped
        # Last: until everything is written, a killed run must be able to continue.
        from_root(lambda: finish(out), comm)
    return summary


def _run_point(
    scene: Scene, out: Path, force: bool, pictures: bool, comm: MPI.Comm | None
) -> dict[str, Any]:
    from iceslide_fem.runs.point import point_history

    with _alone_in(out, scene, force, None, comm):
        started = monotonic()
        passes: list[PassRow] = []
        rows, results = point_history(scene, passes.append)
        summary = _summary(scene, results, started)

        def write() -> None:
            clear_results(out)
            with Table(out / "history.csv", type(rows[0]), 0) as history:
                for row in rows:
                    history.row(row)
            if passes:
                with Table(out / "passes.csv", PassRow, 0) as table:
                    for one in passes:
                        table.row(one)
            _finish(out, summary, pictures)

        from_root(write, comm)
    return summary


def _world() -> MPI.Comm | None:
    """The communicator of all ranks; None for a single process, or without MPI."""
    from iceslide_fem.fenics.start import start_mpi

    with suppress(ImportError):
        return start_mpi().COMM_WORLD if started_by_mpirun() else None
    return None


@contextmanager
def _alone_in(
    out: Path, scene: Scene, force: bool, resumed: Checkpoint | None, comm: MPI.Comm | None
) -> Iterator[None]:
    """Lock `out` for this run, if it may write there. Collective; rank 0 holds the lock."""
    with ExitStack() as claim:

        def take() -> None:
            complaint = functools.partial(other_results, scene)
            read = list(scene.files.values())
            claim.enter_context(claimed(out, complaint, force or resumed is not None, read))

        from_root(take, comm)
        yield


def _summary(scene: Scene, results: dict[str, Any], started: float) -> dict[str, Any]:
    known = versions()
    if scene.model != "point":
        from iceslide_fem.fenics.compat import VERSION, PETSc

        petsc = ".".join(str(part) for part in PETSc.Sys.getVersion())
        known |= {"dolfinx": VERSION, "petsc": petsc}
    wall = monotonic() - started
    warnings = [*before_run(scene), *results.pop("warnings", [])]
    return {
        "verdict": verdict(scene, results).as_dict() if results else None,
        **results,
        "wall_s": wall,
        "warnings": warnings,
        "versions": known,
        "scene": scene.as_dict(),
        "scene_hash": scene_hash(scene),
        "fingerprint": fingerprint(scene),
    }


def _finish(out: Path, summary: dict[str, Any], pictures: bool) -> None:
    """Write summary and, with pictures, the report; on one rank."""
    write_summary(out / "summary.json", summary)
    if not pictures:
        return
    with writing(out / "report.png"):
        draw_run(out)
