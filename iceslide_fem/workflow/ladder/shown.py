"""Output of `iceslide ladder`: tables, and a chart of mu(t) and of error against time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from rich.table import Table

from iceslide_fem.postprocess.results.style import BLACK, BLUE, GREEN, ORANGE, RED
from iceslide_fem.runs.simplifications import Simplifications
from iceslide_fem.workflow.ladder.runs import LevelResult, finest_of

MS = 1e3
COLORS = {"point": ORANGE, "slice": BLUE, "block": GREEN}
MARKS = {"half-space": "^", "column": "s", "continuum": "o", "mesh": "D"}
LINES = {"half-space": ":", "column": "--", "continuum": "-", "mesh": "-."}


def ladder_chart(
    title: str,
    outcomes: Sequence[LevelResult],
    tolerance: float,
    best: LevelResult | None,
    path: Path,
) -> None:
    """Draw the chart to `path` (PNG)."""
    figure = Figure(figsize=(12.5, 5.6), layout="constrained")
    figure.suptitle(title, fontsize=13, fontweight="bold")
    curves, costs = figure.subplots(1, 2)
    finest = finest_of(outcomes)
    floor = 1e-2 * tolerance  # smaller differences are drawn here
    for outcome in outcomes:
        if outcome.run is None:
            continue
        level, history, seconds = outcome.level, outcome.run.history, outcome.run.summary["wall_s"]
        color = BLACK if outcome is finest else COLORS[level.model]
        label = f"{level.model}, {level.heat}"
        label += "" if level.model == "point" else f", refinement {level.refinement:g}"
        curves.plot(
            MS * outcome.run.sliding_time,
            history["mu"],
            LINES[level.heat],
            color=color,
            linewidth=2.0 if outcome is finest else 0.6 + 0.8 * min(level.refinement, 2.0),
            label=label + (" (finest)" if outcome is finest else ""),
        )
        if outcome is finest:
            costs.axvline(seconds, color=BLACK, linestyle=":", linewidth=1.0)
            costs.annotate(
                "finest level",
                (seconds, 1.0),
                (-4, -2),
                xycoords=("data", "axes fraction"),  # free space: slow levels have small errors
                textcoords="offset points",
                ha="right",
                va="top",
            )
            continue
        largest, rms = max(outcome.largest, floor), max(outcome.rms, floor)
        costs.plot([seconds, seconds], [rms, largest], color=color, linewidth=1.0, zorder=1)
        size = 5.0 + 3.0 * min(level.refinement, 2.0)
        costs.plot(seconds, largest, MARKS[level.heat], color=color, markersize=size)
        costs.plot(seconds, rms, "_", color=color, markersize=9)
        if outcome is best:
            costs.plot(seconds, largest, "o", color=RED, markersize=18, fillstyle="none")
    costs.axhline(tolerance, color=RED, linewidth=1.0)
    costs.annotate(
        "tolerance",
        (1.0, tolerance),
        (4, 0),
        xycoords=("axes fraction", "data"),  # beside the panel
        textcoords="offset points",
        color=RED,
        va="center",
    )
    costs.set(
        xscale="log",
        yscale="log",
        xlabel="seconds",
        ylabel=r"relative difference of $\mu(t)$ to the finest level",
        title="Error (mark: largest, bar: rms) against time",
    )
    for mark, heat in zip(MARKS.values(), MARKS, strict=True):
        costs.plot([], [], mark, color="0.4", label=heat)
    for model, color in COLORS.items():
        costs.plot([], [], "s", color=color, label=model)
    costs.legend(fontsize=8, ncols=2)
    curves.set(xlabel="sliding time (ms)", ylabel=r"$\mu$ (1)", title="Friction coefficient")
    curves.set_ylim(bottom=0.0)
    curves.legend(fontsize=8)
    for panel in (curves, costs):
        panel.grid(alpha=0.25)
        panel.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130)


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
