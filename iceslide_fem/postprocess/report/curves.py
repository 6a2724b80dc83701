"""Charts of runs over time and over passes: friction, film, temperature, contact, energies; and a
run's picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from iceslide_fem.postprocess.report.page import Band, Chart, Curve
from iceslide_fem.postprocess.report.png import save_png
from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.postprocess.results.run_directory import PASS
from iceslide_fem.runtime.columns import (
    AREA,
    FRICTION,
    HEIGHT,
    LOADS,
    SQUEEZED,
    VISCOSITY,
    WARMTH,
    Quantity,
)

MS = 1e3
TIME = "sliding time (ms)"


SHARES = {  # columns of the history, and their names
    "contact_fraction": "contact / nominal area",
    "melted_fraction": "melted / contact",
    "saturated_fraction": "saturated / contact",
}
BALANCE = {
    "friction_work_J": "work of friction",
    "ice_heat_J": "warms the ice",
    "latent_heat_J": "melts ice",
    "hysteresis_heat_J": "hysteresis in the rubber",
    "rubber_heat_J": "warms the rubber",
    "elastic_energy_J": "stored in the rubber",
}
ENERGIES = {"J": 1.0, "mJ": 1e3, "µJ": 1e6, "nJ": 1e9}  # unit: how many are a joule
QUANTITIES = (FRICTION, HEIGHT, WARMTH, SQUEEZED)
SAID = 4  # largest number of curves that are described one by one


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


def charts_of(runs: Mapping[str, Run]) -> list[Chart]:
    """The charts common to all runs, with a curve for each run."""
    alone = next(iter(runs.values())) if len(runs) == 1 else None
    charts = []
    drawn = (
        *QUANTITIES,
        VISCOSITY,
        AREA,
        *(load for load in LOADS if _goes_in_time(runs, load)),
    )
    for quantity in drawn:
        curves = [
            _curve(name, run, quantity, number)
            for number, (name, run) in enumerate(runs.items())
            if quantity.column in run.history
        ]
        if not any(np.isfinite(curve.y).any() for curve in curves):
            continue  # the law or film has no such column
        said = "; ".join(map(_said, curves)) if len(curves) <= SAID else _said_of_many(curves)
        bands = phases(alone) if alone is not None else ()
        name = quantity.column
        charts.append(Chart(name, quantity.title, said, TIME, quantity.axis, curves, bands))
    return charts


def _curve(name: str, run: Run, quantity: Quantity, look: int) -> Curve:
    values = quantity.factor * run.history[quantity.column]
    return Curve(name, MS * run.history["time_s"], values, look)


def _goes_in_time(runs: Mapping[str, Run], load: Quantity) -> bool:
    """Whether a load of any run changes in time."""
    columns = (run.history.get(load.column, np.zeros(1)) for run in runs.values())
    return any(np.ptp(column) > 1e-9 * np.abs(column).max() for column in columns)


def _said_of_many(curves: list[Curve]) -> str:
    """End values of the lowest and the highest curve; the table below the chart has all."""
    ends = {curve.name: float(np.asarray(curve.y)[-1]) for curve in curves}
    known = {name: end for name, end in ends.items() if np.isfinite(end)}
    low, high = min(known, key=known.__getitem__), max(known, key=known.__getitem__)
    return (
        f"{len(curves)} curves; at their ends between {ends[low]:.4g} ({low}) and "
        f"{ends[high]:.4g} ({high})"
    )


def _said(curve: Curve) -> str:
    """A curve in words: start, end and extremes."""
    x, y = np.asarray(curve.x), np.asarray(curve.y)
    if not np.isfinite(y).any():
        return f"{curve.name}: none"
    high, low = int(np.nanargmax(y)), int(np.nanargmin(y))
    return (
        f"{curve.name}: from {y[0]:.4g} to {y[-1]:.4g}, largest {y[high]:.4g} at {x[high]:.3g} ms, "
        f"smallest {y[low]:.4g} at {x[low]:.3g} ms"
    )


def phases(run: Run) -> list[Band]:
    """Phases of the film: warming, melting, saturated (ms)."""
    return [Band(name, MS * start, MS * end) for name, (start, end) in run.phases.items()]


def charts_of_one(run: Run) -> list[Chart]:
    """Fractions of the contact, energies, the press, and the steps."""
    time = MS * run.history["time_s"]
    shares = [
        Curve(name, time, 100.0 * run.history[column], number)
        for number, (column, name) in enumerate(SHARES.items())
    ]
    unit = energy_unit(max(float(abs(run.history[column]).max()) for column in BALANCE))
    energies = [
        Curve(name, time, ENERGIES[unit] * run.history[column], number)
        for number, (column, name) in enumerate(BALANCE.items())
        if run.history[column].any()
    ]
    said, title = _ends(shares, "%"), "Contact area and its parts"
    if float(np.max(shares[0].y)) > 100.0:
        said += ". Sides that bulge onto the plate touch it beside the nominal area"
    found = [Chart("shares", title, said, TIME, "fraction (%)", shares, phases(run))]
    if energies:
        said, title = _ends(energies, unit), "Where the work of friction goes"
        found.append(Chart("energies", title, said, TIME, f"E ({unit})", energies))
    found += _preload(run)
    steps = Curve("step", time[1:], 1e6 * run.history["step_s"][1:])
    if np.size(steps.y):
        found.append(Chart("steps", "Steps", _said(steps), TIME, "step (µs)", [steps]))
    return found


def _ends(curves: list[Curve], unit: str) -> str:
    ends = (f"{curve.name} {np.asarray(curve.y)[-1]:.4g} {unit}" for curve in curves)
    return f"At the end: {', '.join(ends)}"


def _preload(run: Run) -> list[Chart]:
    """Friction force over normal force in the press and the speed ramp."""
    if not run.preload:
        return []
    progress, mu = run.preload_friction
    curve = Curve("mu", progress, mu)
    says = f"On the way to t = 0 mu goes from {mu[0]:.3f} to {mu[-1]:.3f}"
    axis = "press (0 to 1), speed ramp (1 to 2)"
    return [Chart("preload", "Before: press and speed ramp", says, axis, "mu (1)", [curve])]


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
            said = (
                "; ".join(map(_ends_said, curves))
                if len(curves) <= SAID
                else f"{len(curves)} curves"
            )
            charts.append(Chart(f"passes-{anchor}", title, said, "pass", axis, curves))
    return charts


def _ends_said(curve: Curve) -> str:
    """A curve in words: start and end."""
    x, y = np.asarray(curve.x), np.asarray(curve.y)
    known = np.flatnonzero(np.isfinite(y))
    first, last = known[0], known[-1]
    return (
        f"{curve.name}: {y[first]:.4g} in pass {x[first]:.0f}, {y[last]:.4g} in pass {x[last]:.0f}"
    )


def energy_unit(largest: float) -> str:
    """The unit of ENERGIES in which `largest` (J) is at least 1, or the smallest unit."""
    return next((unit for unit, factor in ENERGIES.items() if factor * largest >= 1.0), "nJ")
