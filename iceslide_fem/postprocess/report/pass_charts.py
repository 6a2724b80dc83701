"""All charts of runs, those with several passes over the same ice, too; and a run's picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from iceslide_fem.postprocess.report.curves import SAID, charts_of, charts_of_one
from iceslide_fem.postprocess.report.page import Chart, Curve
from iceslide_fem.postprocess.report.png import save_png
from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.postprocess.results.passes import PASS

# Columns of passes.csv: title, axis, factor, and the columns with their names.
_OVER_PASSES = (
    ("mu", "Friction over passes", "μ (1)", 1.0, {"mu_mean": "mean", "mu_peak": "largest"}),
    (
        "temperatures",
        "Temperature of the ice over passes",
        "T (°C)",
        1.0,
        {
            "surface_start_C": "surface as a pass begins",
            "surface_end_C": "surface at its end",
            "base_C": "base at its end",
        },
    ),
    (
        "water",
        "Water at the end of passes",
        "height (nm)",
        1e9,
        {"film_height_m": "film", "squeezed_height_m": "squeezed into the roughness"},
    ),
    ("onset", "Melt onset within passes", "t (ms)", 1e3, {"melt_onset_s": "melt onset"}),
)


def charts_of_run(run: Run) -> list[Chart]:
    """All charts of a run: over passes, if it has several, then of the first and last pass."""
    if not run.passes:
        return [*charts_of({"this run": run}), *charts_of_one(run)]
    last = run.one_pass(-1)
    both = {"pass 1": run.one_pass(1), f"pass {run.passes[PASS].size}": last}
    of_last = [chart._replace(title=f"{chart.title}, last pass") for chart in charts_of_one(last)]
    return [*_over_passes({"": run}), *charts_of(both), *of_last]


def draw_run(directory: Path | str) -> Path:
    """Draw the charts of a finished run as report.png in its directory; returns the path.

    Raises SceneError if the directory holds no finished run.
    """
    path = Path(directory) / "report.png"
    run = read_run(directory)
    save_png(charts_of_run(run), path, run.title)
    return path


def charts_of_runs(runs: Mapping[str, Run]) -> list[Chart]:
    """The charts of several runs; for runs with passes over them, and of the last pass."""
    again = {name: run for name, run in runs.items() if run.passes}
    alone = {
        f"{name}, pass {run.passes[PASS].size}" if run.passes else name: run.one_pass(-1)
        for name, run in runs.items()
    }
    return [*(_over_passes(again) if again else []), *charts_of(alone)]


def _over_passes(runs: Mapping[str, Run]) -> list[Chart]:
    charts = []
    for anchor, title, axis, factor, columns in _OVER_PASSES:
        curves: list[Curve] = []
        for name, run in runs.items():
            for column, words in columns.items():
                values = factor * run.passes[column]
                label = ", ".join(filter(None, (name, words)))
                if np.isfinite(values).any():
                    curves.append(Curve(label, run.passes[PASS], values, len(curves)))
        if curves:
            said = "; ".join(map(_said, curves)) if len(curves) <= SAID else f"{len(curves)} curves"
            charts.append(Chart(f"passes-{anchor}", title, said, "pass", axis, curves))
    return charts


def _said(curve: Curve) -> str:
    """A curve in words: start and end."""
    x, y = np.asarray(curve.x), np.asarray(curve.y)
    known = np.flatnonzero(np.isfinite(y))
    first, last = known[0], known[-1]
    return (
        f"{curve.name}: {y[first]:.4g} in pass {x[first]:.0f}, {y[last]:.4g} in pass {x[last]:.0f}"
    )
