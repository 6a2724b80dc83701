"""Pages of several runs: a comparison, or the levels of a ladder against the finest."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.report.curves import charts_of_runs
from iceslide_fem.postprocess.report.field_drawings import fields_beside
from iceslide_fem.postprocess.report.of_run import RESULTS, of_error, results_of, verdict_of
from iceslide_fem.postprocess.report.page import (
    Cell,
    Chart,
    Curve,
    Page,
    Section,
    Table,
    Text,
)
from iceslide_fem.postprocess.report.words import (
    again,
    all_keys,
    doubts_of,
    in_words,
    left_out,
    neglected,
    versions_of,
)
from iceslide_fem.postprocess.results import Run, names_of, read_run
from iceslide_fem.postprocess.results.run_directory import largest_and_rms
from iceslide_fem.runs.model_levels import ModelLevel, fineness
from iceslide_fem.scene import flat

COMPARED = {key: RESULTS[key][0] for key in ("mu_mean", "mu_peak", "mu_end")}


def _verdicts(runs: Mapping[str, Run]) -> list[Text]:
    """What each result is worth."""
    return [Text(f"{name}: {said}") for name, run in runs.items() if (said := verdict_of(run))]


def page_of_runs(folders: list[Path]) -> Page:
    """Page that compares several runs with the first one."""
    runs = {name: read_run(folder) for name, folder in zip(names_of(folders), folders, strict=True)}
    first = next(iter(runs))
    others = {name: run for name, run in runs.items() if name != first}
    fields = fields_beside(runs)
    beside = [Section("fields", "Fields side by side", fields)] if fields else []
    changed = all_keys({name: run.scene for name, run in runs.items()}, only_different=True)
    same = Text("All of them are of the same scene.")
    stopped = [
        f"{name}: {run.summary['stopped']}"
        for name, run in runs.items()
        if run.summary.get("stopped")
    ]
    return Page(
        title=" against ".join(runs) if len(runs) == 2 else f"{len(runs)} runs: {', '.join(runs)}",
        summary=f"{len(runs)} runs side by side. The first, {first}: {in_words(runs[first].scene)}",
        stopped=" ".join(stopped),
        sections=[
            Section("scenes", "In what they differ", [changed if changed.rows else same]),
            Section(
                "results",
                "Results",
                [
                    *_verdicts(runs),
                    results_of(runs, [left_out(run) for run in runs.values()]),
                    of_error(),
                ],
            ),
            Section(
                "differences",
                f"Against {first}",
                [_differences(others, runs[first]), _distances(others, runs[first])],
            ),
            Section("curves", "Curves", charts_of_runs(runs)),
            *beside,
            _warnings(runs),
            Section(
                "again",
                "Run them again",
                [
                    *again(runs[first].scene),
                    Text(_changes(runs), "code"),
                    Text(f"iceslide report {' '.join(map(str, folders))}", "code"),
                    versions_of({name: run.summary for name, run in runs.items()}),
                ],
            ),
        ],
    )


def _changes(runs: Mapping[str, Run]) -> str:
    """Commands that run the others from the scene of the first."""
    (_, first), *others = runs.items()
    kept = flat(first.scene)
    lines = []
    for name, run in others:
        changed = {
            key: value
            for key, value in flat(run.scene).items()
            if value != kept.get(key) and key != "name" and value is not None
        }
        sets = "".join(
            f" --set {shlex.quote(f'{key}={json.dumps(value)}')}" for key, value in changed.items()
        )
        lines.append(f"iceslide run {first.scene['name']}.toml{sets} --out {name}")
    return "\n".join(lines)


def _warnings(runs: dict[str, Run]) -> Section:
    parts = [
        Text(f"{name}: {part.words}", part.kind)
        for name, run in runs.items()
        for part in doubts_of(run)
    ]
    return Section("warnings", "Warnings", parts)


def _differences(others: dict[str, Run], first: Run) -> Table:
    """Friction of the others less that of the first, and in percent of it."""
    rows = []
    for name, run in others.items():
        cells = [Cell(name)]
        for key in COMPARED:
            value, other = run.summary.get(key), first.summary.get(key)
            text = "–"
            if value is not None and other:
                text = f"{value - other:+.4f} ({value / other - 1.0:+.2%})"
            cells.append(Cell(text, key, value))
        rows.append(cells)
    return Table("Difference, and percent", ["", *COMPARED.values()], rows)


def _distances(others: dict[str, Run], first: Run) -> Table:
    rows = []
    for name, run in others.items():
        largest, rms = largest_and_rms(run, first)
        end = min(float(each.sliding_time[-1]) for each in (run, first))
        texts = f"{largest:.2%}", f"{rms:.2%}", f"{1e3 * end:.4g} ms"
        rows.append([*map(Cell, (name, *texts))])
    head = ["", "largest", "rms", "until"]
    return Table("Relative difference of mu at equal times", head, rows)


def page_of_ladder(folder: Path, summaries: list[Path]) -> Page:
    """Page of the levels of a ladder: error relative to the finest level, and time."""
    runs = sorted((read_run(path.parent) for path in summaries), key=_fineness)
    finest = runs[-1]
    named = {run.directory.name: run for run in runs}
    rows = []
    for name, run in named.items():
        largest, rms = largest_and_rms(run, finest)
        texts = ["finest", ""] if run is finest else [f"{largest:.2%}", f"{rms:.2%}"]
        wall, mean = float(run.summary["wall_s"]), run.summary["mu_mean"]
        texts += [f"{wall:.2f}", verdict(run, finest, largest)]
        rows.append([Cell(name), Cell(f"{mean:.4f}", "mu_mean", mean), *map(Cell, texts)])
    head = ["level", "mean mu", "largest difference", "rms", "seconds", ""]
    return Page(
        title=f"{finest.scene['name']}: every level",
        summary=f"{verdict_of(finest)} The same scene on every level of the model ladder that was "
        f"worth running. The finest, with which the others are compared: {in_words(finest.scene)}",
        sections=[
            Section(
                "results",
                "The ladder",
                [Table("Levels in the order of what they leave out", head, rows)],
            ),
            Section("curves", "Curves", [*error_over_time(named, finest), *charts_of_runs(named)]),
            _warnings(named),
            Section(
                "neglected",
                "What the finest level leaves out",
                neglected(left_out(finest), finest.scene),
            ),
            Section(
                "again",
                "Run it again",
                [
                    *again(finest.scene, "ladder"),
                    Text(
                        f"iceslide report {folder}/LEVEL, for each folder in it, makes the page of "
                        "that level."
                    ),
                    versions_of({finest.directory.name: finest.summary}),
                ],
            ),
        ],
    )


def error_over_time(runs: Mapping[str, Run], finest: Run) -> list[Chart]:
    """Chart of each level's difference of mu(t) to the `finest` over its seconds, if there is one.

    A difference below 1 % of the tolerance is drawn there.
    """
    tolerance = finest.scene["numerics"]["tolerance"]
    levels = [
        Curve(
            name,
            [float(run.summary["wall_s"])],
            [max(largest_and_rms(run, finest)[0], 1e-2 * tolerance)],
            look,
            True,
        )
        for look, (name, run) in enumerate(runs.items())
        if run is not finest
    ]
    if not levels:
        return []
    seconds = [float(run.summary["wall_s"]) for run in runs.values()]
    says = (
        f"Largest difference of mu(t) to the finest level, {finest.directory.name}, over the "
        f"seconds that a level took; the tolerance is {tolerance:g}"
    )
    limit = Curve("tolerance", [min(seconds), max(seconds)], [tolerance] * 2, 3)
    title, y = "Error against time", "difference of mu(t)"
    return [Chart("cost", title, says, "seconds", y, [*levels, limit], logarithmic="xy")]


def verdict(run: Run, finest: Run, largest: float) -> str:
    """Whether a level's `largest` difference to the `finest` is small enough."""
    if run.summary.get("stopped"):
        return "stopped before its end"
    tolerance = finest.scene["numerics"]["tolerance"]
    return "within the tolerance" if run is not finest and largest <= tolerance else ""


def _fineness(run: Run) -> Any:
    scene = run.scene
    refinement = 1.0 if scene["model"] == "point" else scene["numerics"]["refinement"]
    return fineness(ModelLevel(scene["model"], scene["ice"]["heat"], refinement))
