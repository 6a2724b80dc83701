"""Runs started by the page: each is a separate process of `iceslide run`.

A run stops when its page or the server ends, in any way. It gets SIGTERM and keeps its accepted
steps.
"""

from __future__ import annotations

import os
import runpy
import signal
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.postprocess.results.run_directory import sliding_time
from iceslide_fem.runs.checkpoint import FILE as CHECKPOINT
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_writable
from iceslide_fem.runtime.folders import check_folder
from iceslide_fem.runtime.launch import environment_of_one, module_words
from iceslide_fem.scene import Scene
from iceslide_fem.simulate import other_results
from iceslide_fem.workflow.sweep.processes import write_scene
from iceslide_fem.workflow.sweep.table import SENTENCE


def _watch() -> None:
    while os.read(0, 1):  # not sys.stdin: a thread waiting in it aborts at exit
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    threading.Thread(target=_watch, daemon=True).start()
    runpy.run_module("iceslide_fem.cli", run_name="__main__")  # by name: it imports this folder


SECONDS_TO_STOP = 60.0  # for the present step and a checkpoint
SECONDS_UNWATCHED = 5.0  # time for a page to reload
MOST_AT_A_TIME = 2


@dataclass
class StartedRun:
    """A run of `scene` in `folder`, with the output of its process in `log`.

    begun: system time of its start, s, to distinguish its files from older ones; watchers: number
    of pages that follow it, and the time since there are none; given_up: a user has cancelled it.
    """

    scene: Scene
    folder: Path
    process: subprocess.Popen[bytes]
    log: Path
    begun: float
    watchers: int = 0
    unwatched_since: float = field(default_factory=time.monotonic)
    asked_to_stop: bool = False
    given_up: bool = False

    def cancel(self) -> None:
        """Stop, so that another run may replace what it leaves."""
        self.given_up = True
        self.stop()

    def stop(self) -> None:
        """Request a stop; a second request ends it immediately."""
        if self.process.poll() is None:
            self.asked_to_stop = True
            self.process.terminate()

    def progress(self, known: int | None = 0) -> dict[str, Any]:
        """Progress: state, phase, fraction of the duration (0 to 1), last output.

        rows: sliding time (ms) without rests, and mu, of accepted steps from the `known`-th on;
        none if it is None.
        """
        rows = self._rows("history.csv")
        code = self.process.poll()
        said = self.log.read_text(encoding="utf-8", errors="replace")
        passes = max(self.scene.load.passes, self.scene.rubber.rows)
        last = rows[-1][0] / (passes * self.scene.load.duration) if rows else 0.0
        return {
            "name": self.scene.name,
            "folder": str(self.folder),
            "state": self._state(code),
            "phase": "sliding" if rows else self._before_sliding(),
            "share": 1.0 if code == 0 else last,
            "count": len(rows),
            "rows": [] if known is None else [(1e3 * when, mu) for when, mu in rows[known:]],
            "sentence": _sentence(said) if code not in (None, 0) else "",
            "goes_on": code not in (None, 0) and (self.folder / CHECKPOINT).is_file(),
            "report": code is not None and self.report() is not None,
        }

    def _state(self, code: int | None) -> str:
        if code is None:
            return "stopping" if self.asked_to_stop else "running"
        if code == 0:
            return "done"
        return "cancelled" if self.asked_to_stop else "failed"

    def _before_sliding(self) -> str:
        """Progress of the press or the speed ramp."""
        path = self.folder / "preload.csv"
        if not self._is_new(path):
            return "starting"
        return "speed ramp" if "\nramp," in path.read_text(encoding="utf-8") else "pressing"

    def report(self) -> Path | None:
        """The report page of the run, else its picture, else None."""
        found = (self.folder / name for name in ("report.html", "report.png"))
        return next((path for path in found if self._is_new(path)), None)

    def _is_new(self, path: Path) -> bool:
        try:
            return path.stat().st_mtime >= self.begun
        except OSError:
            return False

    def _rows(self, name: str) -> list[tuple[float, float]]:
        """Sliding time (s) and mu of complete rows of the history."""
        path = self.folder / name
        if not self._is_new(path):
            return []
        head, *lines = path.read_text(encoding="utf-8").split("\n")[:-1] or [""]
        columns = head.split(",")
        cells = [line.split(",") for line in lines]
        table: dict[str, Array] = {
            name: np.array([float(row[columns.index(name)]) for row in cells])
            for name in ("time_s", "step_s", "mu", "pass")
            if name in columns
        }
        if not cells:
            return []
        return list(zip(sliding_time(table).tolist(), table["mu"].tolist(), strict=True))


class Runs:
    """All runs of one server by number; `close` ends those still running."""

    def __init__(self, base: Path) -> None:
        """Runs with folders in `base`."""
        self._base = base
        self._started: dict[int, StartedRun] = {}
        self._lock = threading.Lock()
        self._scenes = tempfile.TemporaryDirectory(prefix="iceslide-app-")

    def folder(self, scene: Scene) -> Path:
        """Output folder of `scene`."""
        return self._base / scene.name

    def start(self, scene: Scene, force: bool, resume: bool) -> int:
        """Start or continue `scene`; returns its number. It replaces a run that was given up.

        Raises SceneError if its folder is not writable, or if too many runs are active.
        """
        out = self.folder(scene)
        with self._lock:
            running = [run for run in self._started.values() if run.process.poll() is None]
            if any(run.folder == out for run in running):
                raise SceneError(f"{out} is in use: a run of this page is writing there")
            if len(running) >= MOST_AT_A_TIME:
                raise SceneError(
                    f"{len(running)} runs are under way; allowed at a time: {MOST_AT_A_TIME}"
                )
            if resume:
                check_writable(out)
            else:
                before = [run for run in self._started.values() if run.folder == out]
                force = force or (bool(before) and before[-1].given_up)
                same = partial(other_results, resolved(scene))
                check_folder(out, same, force, scene.files.values())
            number = len(self._started) + 1
            self._started[number] = self._begin(scene, out, force, resume, number)
        return number

    def _begin(self, scene: Scene, out: Path, force: bool, resume: bool, number: int) -> StartedRun:
        file = Path(self._scenes.name) / f"{number}.toml"
        write_scene(file, scene)
        log = file.with_suffix(".log")
        words = module_words("iceslide_fem.app.runs", "run")
        words += ["--restart", str(out)] if resume else [str(file), "--out", str(out)]
        words += ["--force"] if force and not resume else []
        words += ["--checkpoint-every", "5"]
        begun = 0.0 if resume else time.time() - 0.01  # file times are coarse
        with open(log, "wb") as said:
            process = subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=said,
                stderr=said,
                env=environment_of_one(),
                start_new_session=True,  # Ctrl-C goes to the server only
            )
        return StartedRun(scene, out, process, log, begun)

    def listed(self) -> list[dict[str, Any]]:
        """The number and the progress of every run of this server, without its rows."""
        started = sorted(self._started.items())
        return [{"number": number, **run.progress(None)} for number, run in started]

    def get(self, number: int) -> StartedRun:
        """The run with this number. Raises SceneError if there is none."""
        try:
            return self._started[number]
        except KeyError:
            raise SceneError(f"there is no run {number}") from None

    def stop_unwatched(self) -> None:
        """Stop runs that no page has followed for a while."""
        for run in list(self._started.values()):
            alone = run.watchers == 0 and not run.asked_to_stop
            if alone and time.monotonic() - run.unwatched_since > SECONDS_UNWATCHED:
                run.stop()

    def close(self) -> None:
        """Stop all active runs, wait for their output, and remove the scene files."""
        running = [run for run in self._started.values() if run.process.poll() is None]
        for run in running:
            if not run.asked_to_stop:
                run.stop()
        end = time.monotonic() + SECONDS_TO_STOP
        for run in running:
            try:
                run.process.wait(max(end - time.monotonic(), 0.1))
            except subprocess.TimeoutExpired:
                run.process.kill()
        self._scenes.cleanup()


def _sentence(said: str) -> str:
    """The last message of the command."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    told = [line for line in lines if line.startswith(SENTENCE)]
    return (told or lines or [""])[-1].removeprefix(SENTENCE)
