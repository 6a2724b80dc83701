"""Whole runs of the command, on ranks, with options of PETSc or by another tree's package, and
what that changes.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil

from iceslide_fem.postprocess.results.run_directory import read_run
from iceslide_fem.runtime.arrays import Array
from scripts.studies.common import ROOT, run_words

CASES = {  # each with what else is changed
    "thesis_1bar": (),
    "thesis_5bar": (),
    "tread_block": ("model=block", "numerics.refinement=1.75"),
}
MOMENT = ("load.duration=0.1ms", "numerics.refinement=0.5")
TIMES = 400  # at which mu(t) is compared


class Found(NamedTuple):
    """A run: its summary, mu at TIMES, and the most memory of one of its processes, bytes."""

    summary: dict[str, Any]
    mu: Array
    memory: int


def found(case: str, changes: Sequence[str], ranks: int, *solver: str, tree: Path = ROOT) -> Found:
    """A run of the command with PETSc's options for the `solver`, by the package of a `tree`.

    Raises CalledProcessError.
    """
    with tempfile.TemporaryDirectory() as folder:
        more = ["--no-report", *(["--", *solver] if solver else [])]
        path = ROOT / "cases" / f"{case}.toml"
        words = run_words(path, folder, *changes, "output.times=1", ranks=ranks, more=more)
        paths = os.environ | {"PYTHONPATH": str(tree)}
        memory = _run(words, cwd=tree, env=paths)
        run = read_run(folder)
        times = np.linspace(0.0, run.history["time_s"][-1], TIMES)
        mu = np.interp(times, run.history["time_s"], run.history["mu"])
        return Found(dict(run.summary), mu, memory)


def _run(words: Sequence[str], **settings: Any) -> int:
    """Run a command; the most memory that one of its processes has had (bytes), as looked at ten
    times a second. Raises CalledProcessError.
    """
    largest = 0
    with (
        tempfile.TemporaryFile() as said,
        subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=said, **settings) as command,
    ):
        process = psutil.Process(command.pid)
        while command.poll() is None:
            with contextlib.suppress(psutil.Error):
                for one in [process, *process.children(recursive=True)]:
                    largest = max(largest, one.memory_info().rss)
            time.sleep(0.1)
        if command.returncode:
            said.seek(0)
            raise subprocess.CalledProcessError(command.returncode, words, stderr=said.read())
    return largest


def moved(run: Found, exact: Found) -> tuple[str, str]:
    """Largest difference of mu(t), and that of its mean, over the mean of the `exact` one."""
    mean = exact.mu.mean()
    return f"{np.abs(run.mu - exact.mu).max() / mean:.1e}", f"{run.mu.mean() / mean - 1.0:+.1e}"
