"""The model ladder as a chart: mu(t) of every rung, and its error against the seconds it took."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from iceslide_fem.postprocess.results.report import MS
from iceslide_fem.postprocess.results.style import BLACK, BLUE, GREEN, ORANGE, RED
from iceslide_fem.workflow.ladder.runs import RungResult, finest_of

COLORS = {"point": ORANGE, "slice": BLUE, "block": GREEN}
MARKS = {"half-space": "^", "column": "s", "continuum": "o", "mesh": "D"}
LINES = {"half-space": ":", "column": "--", "continuum": "-", "mesh": "-."}


def ladder_chart(
    title: str,
    outcomes: Sequence[RungResult],
    tolerance: float,
    best: RungResult | None,
    path: Path,
) -> None:
    """Draw the chart to `path` (PNG)."""
    figure = Figure(figsize=(12.5, 5.6), layout="constrained")
    figure.suptitle(title, fontsize=13, fontweight="bold")
    curves, costs = figure.subplots(1, 2)
    finest = finest_of(outcomes)
    floor = 1e-2 * tolerance  # smaller differences, exact agreement too, are drawn here
    for outcome in outcomes:
        if outcome.run is None:
            continue
        rung, history, seconds = outcome.rung, outcome.run.history, outcome.run.summary["wall_s"]
        color = BLACK if outcome is finest else COLORS[rung.model]
        label = f"{rung.model}, {rung.heat}"
        label += "" if rung.model == "point" else f", refinement {rung.refinement:g}"
        curves.plot(
            MS * history["time_s"],
            history["mu"],
            LINES[rung.heat],
            color=color,
            linewidth=2.0 if outcome is finest else 0.6 + 0.8 * min(rung.refinement, 2.0),
            label=label + (" (finest)" if outcome is finest else ""),
        )
        if outcome is finest:
            costs.axvline(seconds, color=BLACK, linestyle=":", linewidth=1.0)
            costs.annotate(
                "finest rung",
                (seconds, 1.0),
                (-4, -2),
                xycoords=("data", "axes fraction"),  # slow rungs have small errors: none up here
                textcoords="offset points",
                ha="right",
                va="top",
            )
            continue
        largest, rms = max(outcome.largest, floor), max(outcome.rms, floor)
        costs.plot([seconds, seconds], [rms, largest], color=color, linewidth=1.0, zorder=1)
        size = 5.0 + 3.0 * min(rung.refinement, 2.0)
        costs.plot(seconds, largest, MARKS[rung.heat], color=color, markersize=size)
        costs.plot(seconds, rms, "_", color=color, markersize=9)
        if outcome is best:
            costs.plot(seconds, largest, "o", color=RED, markersize=18, fillstyle="none")
    costs.axhline(tolerance, color=RED, linewidth=1.0)
    costs.annotate(
        "tolerance",
        (1.0, tolerance),
        (4, 0),
        xycoords=("axes fraction", "data"),  # beside the panel, where no mark can be
        textcoords="offset points",
        color=RED,
        va="center",
    )
    costs.set(
        xscale="log",
        yscale="log",
        xlabel="seconds",
        ylabel=r"relative difference of $\mu(t)$ to the finest rung",
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
