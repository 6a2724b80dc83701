"""Whole runs of the command, on ranks, with options of PETSc or by another tree's package, and
what that changes.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

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
    """A run: its summary, and mu at TIMES."""

    summary: dict[str, Any]
    mu: Array


def found(case: str, changes: Sequence[str], ranks: int, *solver: str, tree: Path = ROOT) -> Found:
    """A run of the command with PETSc's options for the `solver`, by the package of a `tree`.

    Raises CalledProcessError.
    """
    with tempfile.TemporaryDirectory() as folder:
        more = ["--no-report", *(["--", *solver] if solver else [])]
        path = ROOT / "cases" / f"{case}.toml"
        words = run_words(path, folder, *changes, "output.times=1", ranks=ranks, more=more)
        paths = os.environ | {"PYTHONPATH": str(tree)}
        subprocess.run(words, check=True, capture_output=True, cwd=tree, env=paths)
        run = read_run(folder)
        times = np.linspace(0.0, run.history["time_s"][-1], TIMES)
        mu = np.interp(times, run.history["time_s"], run.history["mu"])
        return Found(dict(run.summary), mu)


def moved(run: Found, exact: Found) -> tuple[str, str]:
    """Largest difference of mu(t), and that of its mean, over the mean of the `exact` one."""
    mean = exact.mu.mean()
    return f"{np.abs(run.mu - exact.mu).max() / mean:.1e}", f"{run.mu.mean() / mean - 1.0:+.1e}"
