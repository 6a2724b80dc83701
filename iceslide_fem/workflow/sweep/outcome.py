"""Outcome of a case: status, summary and curves."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.output.summary import untouched, word_of
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.fingerprint import fingerprint

# Number of evenly spaced samples of a curve, from t = 0 to the end of the case, or over its last
# pass.
SAMPLES = 201
CURVES = ("mu", "film_height_m")
SENTENCE = "iceslide: "  # start of the command's error message
DONE, FAILED, NOT_RUN = "done", "failed", "not run"


class CaseResult(NamedTuple):
    """status: done, failed or not run; reason: a sentence unless done; summary: entries of
    summary.json; curves: by name, (SAMPLES,), SI."""

    status: str
    reason: str = ""
    summary: dict[str, Any] = {}
    curves: dict[str, Array] = {}


NOT_COMPUTED = CaseResult(NOT_RUN, "not computed yet")


def read_outcome(directory: Path, scene: Scene) -> CaseResult:
    """The outcome of the run of `scene` in `directory`, from its files.

    Files of another scene or of another program are ignored, and the case runs again.
    """
    complaint = word_of(directory) or _complaint(directory / "log.txt")
    try:
        run = read_run(directory)
    except SceneError:
        return CaseResult(FAILED, complaint) if complaint else NOT_COMPUTED
    of_this = run.summary.get("fingerprint") == fingerprint(scene)
    if not of_this or not untouched(directory, run.summary):
        return CaseResult(NOT_RUN, f"{directory} holds files that no run of this case wrote")
    stopped = run.summary.get("stopped")
    times = np.linspace(0.0, run.scene["load"]["duration"], SAMPLES)
    history = run.one_pass(-1).history  # the last one
    curves = {
        name: np.interp(times, history["time_s"], history[name], right=np.nan if stopped else None)
        for name in CURVES
    }
    return CaseResult(FAILED if stopped else DONE, stopped or "", run.summary, curves)


def _complaint(log: Path) -> str:
    """The command's error message, or the message about its end."""
    try:
        lines = log.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    said = [line for line in lines if line.startswith(SENTENCE)]
    return said[0].removeprefix(SENTENCE) if said else ""
