"""The page of a run that left no summary: it was stopped before it slid, or it was killed."""

from __future__ import annotations

from pathlib import Path

from iceslide_fem.output.summary import word_of
from iceslide_fem.postprocess.report.curves import QUANTITIES, TIME
from iceslide_fem.postprocess.report.page import Chart, Curve, Page, Section, Text
from iceslide_fem.postprocess.report.words import again, all_keys, as_warning, in_words, scene_of
from iceslide_fem.postprocess.results.run_directory import read_table
from iceslide_fem.run.checkpoint import scene_there
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.notes import notes

LEFT = ("stopped.txt", "checkpoint", "history.csv")


def page_of_unfinished(folder: Path) -> Page:
    """What there is of the run in `folder`, and how it goes on."""
    reason = word_of(folder) or (
        "It was ended before it could say why: it was killed, or the machine stopped."
    )
    try:
        history = read_table(folder / "history.csv")
    except (OSError, ValueError, IndexError):
        history = {}
    rows = history["time_s"].size if "time_s" in history else 0
    charts = []
    for quantity in QUANTITIES if rows > 1 else ():
        values = quantity.factor * history[quantity.column]
        curve = Curve("until then", 1e3 * history["time_s"], values)
        says = f"From {values[0]:.4g} to {values[-1]:.4g}"
        charts.append(Chart(quantity.column, quantity.title, says, TIME, quantity.axis, [curve]))
    end = 1e3 * float(history["time_s"][-1]) if rows else 0.0
    on = (
        f"iceslide run --restart {folder} goes on from its last checkpoint."
        if (folder / "checkpoint").is_file()
        else "There is no checkpoint: it has to be run again from its beginning."
    )
    scene = scene_there(folder)
    words = f"{in_words(scene)} " if scene else ""
    known = scene_of(scene) if scene else None
    doubts = [as_warning(note) for note in notes(known)] if known else []
    return Page(
        title=f"{folder.absolute().name}: a run without an end",
        summary=f"{words}It got to {end:.4g} ms of sliding in {max(rows - 1, 0)} steps and left no "
        "summary.",
        stopped=reason,
        sections=[
            *([Section("warnings", "Warnings", doubts)] if doubts else []),
            *([Section("curves", "Curves until then", charts)] if charts else []),
            *([Section("scene", "The scene", [all_keys({"": scene})])] if scene else []),
            Section("again", "Go on", [Text(on), *(again(scene) if scene else [])]),
        ],
    )


def is_unfinished(folder: Path) -> bool:
    """Whether a run was here that left no summary."""
    try:
        return any((folder / name).is_file() for name in LEFT)
    except OSError as error:
        raise SceneError(f"cannot read {folder}: {error.strerror}") from None
