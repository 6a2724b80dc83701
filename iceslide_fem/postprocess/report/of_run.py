"""The page of a run: finished, stopped, or without a summary because it was killed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from iceslide_fem.output.summary import word_of
from iceslide_fem.postprocess.report.curves import QUANTITIES, TIME, charts_of_run
from iceslide_fem.postprocess.report.field_drawings import fields_of
from iceslide_fem.postprocess.report.page import Cell, Chart, Curve, Page, Section, Table, Text
from iceslide_fem.postprocess.report.words import (
    LeftOut,
    again,
    all_keys,
    as_warning,
    doubts_of,
    in_words,
    left_out,
    scene_of,
    section_again,
)
from iceslide_fem.postprocess.results import Run
from iceslide_fem.postprocess.results.run_directory import read_table, sliding_time
from iceslide_fem.runs.checkpoint import scene_there
from iceslide_fem.runs.doubts import before_run
from iceslide_fem.runtime.columns import SHOWN_IN
from iceslide_fem.runtime.errors import SceneError

# Entries of summary.json: name, unit of display, and whether it has the tolerance as error.
RESULTS = {
    "mu_peak": ("largest mu", "", True),
    "mu_peak_time_s": ("reached after", "ms", False),
    "mu_mean": ("mean mu", "", True),
    "mu_mean_last_pass": ("mean mu of the last pass", "", True),
    "mu_end": ("mu at the end", "", True),
    "melt_onset_s": ("ice melts from", "ms", False),
    "saturation_s": ("free volume full from", "ms", False),
    "energy_imbalance": ("energy imbalance, of the friction work", "%", False),
    "outside_table_fraction": ("contact outside the table of k, D, H_V", "%", False),
}

UNFINISHED = ("stopped.txt", "checkpoint", "history.csv")  # files of such a run


def page_of_run(run: Run, stopped: str = "") -> Page:
    """The page of `run`; stopped: reason of an early end, if the summary has none."""
    stopped = stopped or str(run.summary.get("stopped") or "")
    fields = fields_of(run)
    left = left_out(run)
    over_time = Section("fields", "Fields over time", fields)
    return Page(
        title=run.title,
        summary=" ".join([verdict_of(run), in_words(run.scene)]).strip(),
        stopped=stopped,
        sections=[
            Section(
                "results", "Results", [results_of({run.scene["name"]: run}, [left]), of_error()]
            ),
            Section("warnings", "Warnings", doubts_of(run)),
            Section("curves", "Curves", charts_of_run(run)),
            *([over_time] if fields else []),
            *section_again(run, left),
        ],
    )


def verdict_of(run: Run) -> str:
    """What the result is worth, in words; "" of runs without it."""
    return str((run.summary.get("verdict") or {}).get("sentence", ""))


def results_of(runs: dict[str, Run], left: Sequence[LeftOut]) -> Table:
    """Key results, a column for each run, with their uncertainties; left: of each run's model."""
    rows = []
    for key, (name, unit, has_error) in RESULTS.items():
        if not any(key in run.summary for run in runs.values()):
            continue
        row = [Cell(name)]
        for run, known in zip(runs.values(), left, strict=True):
            value = run.summary.get(key)
            text = "–"
            if key in run.summary:
                text = _result(run, value, unit, known if has_error else None)
            row.append(Cell(text, key, value))
        rows.append(row)
    return Table("Key results", ["", *runs], rows)


def _result(run: Run, value: float | None, unit: str, left: LeftOut | None) -> str:
    """A value in words; with what the model leaves out, the value has errors of friction."""
    if value is None:
        return "did not happen"
    if run.passes and unit == "ms":  # from the start of the first pass
        return f"{value:.4g} s, rests included"
    if left is None:
        return f"{SHOWN_IN.get(unit, 1.0) * value:.4g} {unit}".strip()
    numerical = run.scene["numerics"]["tolerance"] * abs(value)
    if isinstance(left, str):
        return f"{_rounded(value, numerical)}; numerical ± {numerical:.1g}, model not estimated"
    model = abs(value) * sum(one.effect for one, made in left if made)
    text = f"{_rounded(value, numerical + model)}; numerical ± {numerical:.1g}"
    return f"{text}, model up to ± {model:.1g}" if model else text


def _rounded(value: float, error: float) -> str:
    """A friction coefficient with the digits that its error leaves, at most four."""
    digits = 4 if error <= 0.0 else min(max(-math.floor(math.log10(error)), 0), 4)
    return f"{value:.{digits}f}"


def of_error() -> Text:
    """Text on the uncertainties beside a result."""
    return Text(
        "Numerical: numerics.tolerance times the value, the error that steps and layers were "
        "chosen for; iceslide ladder measures that of the mesh. Model: the sum of what this model "
        "leaves out, as estimated before the run. Inputs: the uncertainty of k, D, H_V, the ice's "
        'temperature and the film law itself is in neither (page "Against measurements").'
    )


def page_of_unfinished(folder: Path) -> Page:
    """Page of the unfinished run in `folder`, with the way to continue it."""
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
        curve = Curve("until then", 1e3 * sliding_time(history), values)
        says = f"From {values[0]:.4g} to {values[-1]:.4g}"
        charts.append(Chart(quantity.column, quantity.title, says, TIME, quantity.axis, [curve]))
    end = 1e3 * float(sliding_time(history)[-1]) if rows else 0.0
    on = (
        f"iceslide run --restart {folder} goes on from its last checkpoint."
        if (folder / "checkpoint").is_file()
        else "There is no checkpoint: it has to be run again from its beginning."
    )
    scene = scene_there(folder)
    words = f"{in_words(scene)} " if scene else ""
    known = scene_of(scene) if scene else None
    doubts = [as_warning(note) for note in before_run(known)] if known else []
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
    """Whether the folder has a run without a summary."""
    try:
        return any((folder / name).is_file() for name in UNFINISHED)
    except OSError as error:
        raise SceneError(f"cannot read {folder}: {error.strerror}") from None
