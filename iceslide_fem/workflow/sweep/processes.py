"""Finite element cases of a sweep, several at a time, by workers that each run many (`worker`).

A crash affects one case only. A case is identical to `iceslide run` by hand or in a cluster's
queue.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runs.checkpoint import FILE as CHECKPOINT
from iceslide_fem.runs.checkpoint import fingerprint_there, read_checkpoint
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.launch import available_cores, environment_of_one, module_words
from iceslide_fem.scene import Scene, as_toml, load_scene
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.workflow.sweep.plan import Case
from iceslide_fem.workflow.sweep.table import SENTENCE, CaseResult, read_outcome
from iceslide_fem.workflow.sweep.worker import Worker


class Cores(NamedTuple):
    """Processes (one core each) per case, and cases at a time."""

    per_case: int
    at_a_time: int


def share_cores(per_case: int, at_a_time: int | None) -> Cores:
    """Cores for a sweep; without `at_a_time`, as many cases as the cores allow.

    Raises SceneError if this exceeds the cores of this process.
    """
    available = available_cores()
    at_a_time = max(available // per_case, 1) if at_a_time is None else at_a_time
    if per_case * at_a_time > available:
        raise SceneError(
            f"{at_a_time} cases at a time on {per_case} cores each need {at_a_time * per_case} "
            f"cores; allowed here: {available}"
        )
    return Cores(per_case, at_a_time)


def case_folder(folder: Path, case: Case) -> Path:
    """Directory of a case's run."""
    return folder / "cases" / case.name


def take_over(folder: Path, cases: Sequence[Case]) -> None:
    """Rename the directories of `cases` that another sweep in `folder` has under other names.

    A checkpoint of another scene under the name of a case is removed.
    """
    there = {_fingerprint_in(path): path for path in (folder / "cases").glob("*/")}
    for case in cases:
        here, old = case_folder(folder, case), there.get(case.fingerprint)
        if old is not None and not here.exists():
            old.rename(here)
        elif fingerprint_there(here) not in (None, case.fingerprint):
            (here / CHECKPOINT).unlink()


def _fingerprint_in(directory: Path) -> str | None:
    """Fingerprint of the scene of the run in a directory."""
    try:
        return fingerprint_there(directory) or str(read_run(directory).summary["fingerprint"])
    except (SceneError, KeyError):
        return None


def scene_file(folder: Path, case: Case) -> Path:
    """The complete scene of a case, written to its directory; the file's path."""
    path = case_folder(folder, case) / "scene.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_scene(path, case.scene)
    return path


def write_scene(path: Path, scene: Scene) -> None:
    """Write the complete scene to `path`, with absolute paths of its files."""
    replace_file(path, as_toml(scene.as_dict()))


def forms_of(scene: Scene) -> tuple[object, ...]:
    """Key of the compiled forms of a scene: scenes with equal keys are compiled once.

    Material constants, loads and sizes are data of the forms, not code.
    """
    rubber, ice = scene.rubber, scene.ice
    return scene.model, ice.heat, ice.motion, rubber.heat, rubber.inertia, rubber.mesh, rubber.step


def check_meshes(cases: Sequence[Case]) -> None:
    """Raise SceneError if a mesh file of `cases` cannot be used, before the first one runs."""
    kinds = {
        (case.scene.model, case.scene.rubber.mesh or case.scene.rubber.step): case for case in cases
    }
    for (_, drawing), case in kinds.items():
        if drawing is not None:
            with tempfile.TemporaryDirectory() as folder:
                done = _python("iceslide_fem.cli", "info", scene_file(Path(folder), case))
            if done.returncode == SceneError.exit_code:
                raise SceneError(done.stderr.strip().removeprefix(SENTENCE))


def prepare(folder: Path, cases: Sequence[Case]) -> None:
    """Compile the forms of all `cases`, each kind once.

    A scene that cannot be built is skipped; its case then fails with the reason.
    """
    for case in {forms_of(case.scene): case for case in cases}.values():
        _python("iceslide_fem.workflow.sweep.processes", scene_file(folder, case))


def _python(module: str, *words: Any) -> subprocess.CompletedProcess[str]:
    """Run a module of this program as a separate process, without a terminal."""
    return subprocess.run(
        module_words(module, *map(str, words)),
        env=environment_of_one(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def compute(folder: Path, cases: Sequence[Case], cores: Cores) -> Iterator[tuple[Case, CaseResult]]:
    """Run `cases`, and yield each with its outcome when it ends.

    If the caller stops early (an interrupt), running cases get SIGTERM and are awaited; no new ones
    start.
    """
    workers = [Worker(cores.per_case) for _ in range(cores.at_a_time)]
    free = SimpleQueue[Worker]()
    for worker in workers:
        free.put(worker)

    def one(case: Case) -> CaseResult:
        worker = free.get()
        try:
            _run(folder, case, worker)
        finally:
            free.put(worker)
        return read_outcome(case_folder(folder, case), case.scene)

    try:
        with ThreadPoolExecutor(cores.at_a_time) as pool:
            futures = {pool.submit(one, case): case for case in cases}
            try:
                for future in as_completed(futures):
                    yield futures[future], future.result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for worker in workers:
                    worker.stop()
                raise
    finally:
        for worker in workers:
            worker.end()


def compute_all(folder: Path, scenes: Mapping[str, Scene]) -> dict[str, CaseResult]:
    """Run all `scenes` in `folder`, on all cores, and return their outcomes by name."""
    cases = [Case(name, scene, fingerprint(scene)) for name, scene in scenes.items()]
    prepare(folder, cases)
    found = {case.name: result for case, result in compute(folder, cases, share_cores(1, None))}
    return {name: found[name] for name in scenes}


def _run(folder: Path, case: Case, worker: Worker) -> None:
    """Run or continue a case, and wait; its output goes to log.txt in its directory."""
    directory = case_folder(folder, case)
    scene, log = scene_file(folder, case), directory / "log.txt"
    log.unlink(missing_ok=True)
    try:
        read_checkpoint(directory)
        restart = True
    except SceneError:  # the folder belongs to this case: invalid results are replaced
        restart = False
    code = worker.run(scene, directory, restart, log)
    if code != 0:  # last line: used only without an error message of the command
        end = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        with open(log, "a", encoding="utf-8") as file:
            file.write(f"\n{SENTENCE}ended by {end}, see {log}\n")


def compile_forms(scene: Scene) -> None:
    """Build block and interface of `scene` once and discard them."""
    from iceslide_fem.fenics.compat import MPI
    from iceslide_fem.interface.build import film_frame_of
    from iceslide_fem.mechanics.block import build_block

    block = build_block(scene, MPI.COMM_WORLD)
    block.rubber.displacements[:, -1] -= 1e-6 * block.height  # meshing of the ice needs contact
    film_frame_of(block)


if __name__ == "__main__":
    kinds = {forms_of(scene): scene for scene in map(load_scene, sys.argv[1:])}
    for kind in kinds.values():
        compile_forms(kind)
