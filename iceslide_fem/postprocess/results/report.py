"""One page of curves for a finished run: friction, film, temperature and energy over time."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.postprocess.results.pass_picture import draw_passes
from iceslide_fem.postprocess.results.quantities import (
    BALANCE,
    ENERGIES,
    HEIGHT,
    LOADS,
    SHARES,
    SQUEEZED,
    WARMTH,
    Quantity,
    energy_unit,
)
from iceslide_fem.postprocess.results.style import (
    BLACK,
    BLUE,
    GREEN,
    MELTING,
    ORANGE,
    RED,
    SATURATED,
)
from iceslide_fem.runtime.units import ZERO_CELSIUS

MS = 1e3
WIDTH, ROW, DPI = 11.5, 3.2, 110  # of the page and of a row of panels (inches)
TICKS = 5  # per axis: a tick takes as long to draw as a curve
SHADES = {"warming": "white", "melting": MELTING, "saturated": SATURATED}


def report(directory: Path | str) -> Path:
    """Draw `report.png` in the directory of a finished run and return its path.

    Raises SceneError if the directory holds no finished run.
    """
    run = read_run(directory)
    figure = draw_passes(run) if run.passes else _draw(run)
    path = Path(directory) / "report.png"
    figure.savefig(path, dpi=DPI)
    return path


def _draw(run: Run) -> Figure:
    """Curves over the sliding time."""
    changes = any(isinstance(run.scene["load"][name], list) for name in ("pressure", "speed"))
    before = "preload" if run.preload else "mu"
    layout = [
        [before, "mu", "film"],
        ["temperature", "temperature", "squeezed"],
        ["shares", "shares", "energy"],
        *([["pressure", "pressure", "speed"]] if changes else []),
    ]
    figure = Figure(figsize=(WIDTH, len(layout) * ROW), layout="constrained")
    figure.suptitle(run.title, fontsize=14, fontweight="bold")
    panels = figure.subplot_mosaic(layout, width_ratios=[1.0, 4.0, 5.0])  # type: ignore[arg-type]
    _friction(panels["mu"], run)
    _curve(panels["film"], run, HEIGHT, BLUE).set_ylim(bottom=0.0)
    _curve(panels["squeezed"], run, SQUEEZED, GREEN).set_ylim(bottom=0.0)
    _curve(panels["temperature"], run, WARMTH, RED)
    melting = run.ice.melting_temperature - ZERO_CELSIUS
    panels["temperature"].axhline(melting, color="0.5", linestyle=":")
    _shares(panels["shares"], run)
    _energy(panels["energy"], run)
    for name, load in LOADS.items() if changes else ():
        largest = load.factor * run.history[load.column].max()
        _curve(panels[name], run, load, BLACK).set_ylim(0.0, 1.1 * largest)
    for name, panel in panels.items():
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(alpha=0.25)
        if name != "preload":
            panel.locator_params(axis="x", nbins=TICKS, steps=[1, 2, 5, 10])
            panel.set_xlabel("sliding time (ms)")
            # a run may have no length
            panel.set_xlim(0.0, MS * (run.history["time_s"][-1] or run.scene["load"]["duration"]))
            _shade_phases(panel, run)
    _name_phases(figure, run)
    if run.preload:
        _preload(panels["preload"], run)
        panels["preload"].set_ylim(panels["mu"].get_ylim())
        panels["mu"].set_ylabel("")
    for name, panel in panels.items():
        if name != "shares":
            panel.locator_params(axis="y", nbins=TICKS, steps=[1, 2, 5, 10])
    return figure


def _shade_phases(panel: Axes, run: Run) -> None:
    for name, (start, stop) in run.phases.items():
        panel.axvspan(MS * start, MS * stop, color=SHADES[name], zorder=-2, linewidth=0)
        if start > 0.0:
            panel.axvline(MS * start, color="0.6", linewidth=0.8, zorder=-1)


def _name_phases(figure: Figure, run: Run) -> None:
    patches = [
        Patch(
            facecolor=SHADES[name],
            edgecolor="0.6",
            label=f"{name}, from {MS * start:.2f} ms" if start > 0.0 else name,
        )
        for name, (start, _) in run.phases.items()
    ]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches), frameon=False)


def _friction(panel: Axes, run: Run) -> None:
    history, summary = run.history, run.summary
    panel.plot(MS * history["time_s"], history["mu"], color=BLUE, linewidth=2)
    time, peak = MS * summary["mu_peak_time_s"], summary["mu_peak"]
    panel.plot(time, peak, "o", color=RED)
    early = time < 0.5 * MS * history["time_s"][-1]
    panel.annotate(
        f"peak {peak:.3f} at {time:.2f} ms",
        (time, peak),
        (4 if early else -4, 8),
        textcoords="offset points",
        color=RED,
        ha="left" if early else "right",
    )
    panel.set(title=f"Friction coefficient, mean {summary['mu_mean']:.3f}", ylabel="μ (1)")
    panel.set_ylim(0.0, 1.2 * peak)


def _preload(panel: Axes, run: Run) -> None:
    """Friction force over normal force against the progress of press and speed ramp."""
    panel.plot(*run.preload_friction, ".-", color=BLUE, linewidth=1.2, markersize=4)
    panel.axvline(1.0, color="0.6", linewidth=0.8)
    panel.set(title="Before", ylabel="μ (1)", xlim=(0.0, 2.0))
    panel.set_xticks([0.5, 1.5], ["press", "speed\nramp"])


def _curve(panel: Axes, run: Run, quantity: Quantity, color: str) -> Axes:
    """A column of the history in time."""
    values = quantity.factor * run.history[quantity.column]
    panel.plot(MS * run.history["time_s"], values, color=color, linewidth=2)
    panel.set(title=quantity.title, ylabel=quantity.axis)
    return panel


def _shares(panel: Axes, run: Run) -> None:
    looks = (BLACK, "-"), (BLUE, "--"), (ORANGE, "-.")
    for (column, label), (color, style) in zip(SHARES.items(), looks, strict=True):
        values = 100.0 * run.history[column]
        panel.plot(MS * run.history["time_s"], values, style, color=color, label=label, linewidth=2)
    panel.set(title="Contact area and its parts", ylabel="fraction (%)", ylim=(-4.0, 130.0))
    panel.set_yticks(range(0, 101, 25))
    panel.legend(loc="upper center", ncols=len(looks), frameon=False)


def _energy(panel: Axes, run: Run) -> None:
    colors = dict(zip(BALANCE, (BLACK, BLUE, GREEN, RED), strict=False))  # of heat alone
    unit = energy_unit(max(float(run.history[column].max()) for column in colors))
    for column, color in colors.items():
        values = ENERGIES[unit] * run.history[column]
        if values.any():
            label = BALANCE[column]
            panel.plot(MS * run.history["time_s"], values, color=color, label=label, linewidth=2)
    panel.set(title="Where the work of friction goes", ylabel=f"E ({unit})")
    panel.set_ylim(bottom=0.0)
    if panel.lines:
        panel.legend(loc="upper left", framealpha=0.9)
