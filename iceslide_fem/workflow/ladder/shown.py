"""Output of `iceslide ladder`: tables, and a chart of mu(t) and of error against time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from iceslide_fem.postprocess.report.curves import charts_of_runs
from iceslide_fem.postprocess.report.of_runs import error_over_time
from iceslide_fem.postprocess.report.png import save_png
from iceslide_fem.postprocess.results import Run
from iceslide_fem.runs.simplifications import Simplifications
from iceslide_fem.workflow.ladder.runs import LevelResult, finest_of


def ladder_chart(title: str, outcomes: Sequence[LevelResult], finest: Run, path: Path) -> None:
    """Draw mu(t) of every level, and its error over its seconds, to `path` (PNG)."""
    runs = {outcome.name: outcome.run for outcome in outcomes if outcome.run is not None}
    save_png([charts_of_runs(runs)[0], *error_over_time(runs, finest)], path, title)


def simplification_table(found: Simplifications, tolerance: float) -> Table:
    """Table of the simplifications, as estimated before any run."""
    table = Table(title="What may be neglected? (estimates)", title_justify="left")
    for heading in ("neglecting with", "number", "", "moves mu by", ""):
        table.add_column(heading, justify="right" if heading in ("", "moves mu by") else "left")
    for one in found:
        small = "negligible" if one.effect <= tolerance else ""
        table.add_row(one.name, one.formula, f"{one.number:.2g}", f"{one.effect:.2g}", small)
    return table


def ladder_table(outcomes: Sequence[LevelResult]) -> Table:
    """Every level that was run: friction, difference of mu(t) to the finest, time and memory."""
    table = Table(title="The ladder", title_justify="left")
    for heading in ("level", "mean mu", "largest", "rms", "seconds", "MB"):
        table.add_column(heading, justify="left" if heading == "level" else "right", no_wrap=True)
    finest = finest_of(outcomes)
    for outcome in outcomes:
        if outcome.run is None:
            continue
        errors = [f"{outcome.largest:.2%}", f"{outcome.rms:.2%}"]
        table.add_row(
            outcome.name,
            f"{outcome.run.summary['mu_mean']:.4f}",
            *(["finest", ""] if outcome is finest else errors),
            f"{outcome.run.summary['wall_s']:.1f}",
            f"{outcome.memory / 1e6:.0f}",
        )
    return table


def not_run(outcomes: Sequence[LevelResult]) -> list[str]:
    """A sentence for each reason of levels that did not run, or not to their end."""
    reasons: dict[str, list[str]] = {}
    for outcome in outcomes:
        if outcome.run is None:
            reasons.setdefault(outcome.note, []).append(outcome.name)
    return [f"{', '.join(names)}: {reason}." for reason, names in reasons.items()]
