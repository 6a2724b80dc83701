"""One page of curves for a run with several passes over the same ice.

The left side has changes from pass to pass. The right side has the first and the last pass over
their time.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from iceslide_fem.postprocess.results import Run
from iceslide_fem.postprocess.results.passes import PASS
from iceslide_fem.postprocess.results.quantities import FRICTION, HEIGHT, WARMTH, Quantity
from iceslide_fem.postprocess.results.style import BLUE, GREEN, ORANGE, PURPLE, RED
from iceslide_fem.runtime.units import ZERO_CELSIUS

MS, NM = 1e3, 1e9
WIDTH, ROW = 11.5, 3.2  # of the page and of a row of panels (inches)
FEW = 12  # largest number of passes drawn with marks
ENDS = {"first": BLUE, "last": RED}


def draw_passes(run: Run) -> Figure:
    """Friction, temperatures and water of a `run` with passes."""
    figure = Figure(figsize=(WIDTH, 3 * ROW), layout="constrained")
    figure.suptitle(run.title, fontsize=14, fontweight="bold")
    panels = figure.subplots(3, 2, sharex="col")
    (friction, first), (temperatures, second), (water, third) = panels
    over_passes(friction, temperatures, run)
    _water(water, run)
    for panel, quantity, title in (
        (first, FRICTION, "Friction coefficient"),
        (second, WARMTH, "Surface of the ice, mean over the contact"),
        (third, HEIGHT, "Water film, mean over the contact"),
    ):
        _within(panel, run, quantity)
        panel.set_title(f"{title}: first and last pass")
    for panel in panels.flat:
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(alpha=0.25)
        panel.legend(frameon=False)
    water.set_xlabel("pass")
    water.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    third.set_xlabel("time within the pass (ms)")
    return figure


def over_passes(friction: Axes, temperatures: Axes, run: Run) -> None:
    """Mean mu and ice temperature of every pass, on two panels."""
    number, mu = run.passes[PASS], run.passes["mu_mean"]
    friction.plot(number, mu, _line(number), color="0.5")
    for at, (which, colour) in zip((0, -1), ENDS.items(), strict=True):
        friction.plot(number[at], mu[at], "o", color=colour, label=f"{which} pass: {mu[at]:.3f}")
    friction.set(title="Mean friction coefficient of each pass", ylabel="mean μ (1)")
    friction.set_ylim(0.0, 1.5 * mu.max())
    for column, label, colour in (
        ("surface_end_C", "surface as the pass ends", ORANGE),
        ("surface_start_C", "surface as the pass begins", PURPLE),
        ("base_C", "base of the ice as the pass ends", GREEN),
    ):
        values = run.passes[column]
        if np.isfinite(values).any():
            temperatures.plot(number, values, _line(number), color=colour, label=label)
    _melting_point(temperatures, run)
    temperatures.set(title="Temperature of the ice", ylabel="T (°C)")


def _water(panel: Axes, run: Run) -> None:
    """Water at the end of every pass."""
    number = run.passes[PASS]
    for column, label, colour in (
        ("film_height_m", "film", BLUE),
        ("squeezed_height_m", "squeezed into the roughness", GREEN),
    ):
        panel.plot(number, NM * run.passes[column], _line(number), color=colour, label=label)
    panel.set(title="Water at the end of each pass", ylabel="height (nm)")
    panel.set_ylim(bottom=0.0)


def _within(panel: Axes, run: Run, quantity: Quantity) -> None:
    """A column of the history in the first and the last pass."""
    last = run.passes[PASS].size
    for number, (which, colour) in zip((1, last), ENDS.items(), strict=True):
        history = run.one_pass(number).history
        values = quantity.factor * history[quantity.column]
        style, label = "-" if which == "first" else "--", f"{which} pass"
        panel.plot(MS * history["time_s"], values, style, color=colour, label=label, linewidth=2)
    if quantity is WARMTH:
        _melting_point(panel, run)
    else:
        panel.set_ylim(bottom=0.0)
    panel.set_ylabel(quantity.axis)


def _melting_point(panel: Axes, run: Run) -> None:
    melting = run.ice.melting_temperature - ZERO_CELSIUS
    panel.axhline(melting, color="0.5", linestyle=":", label="melting point")


def _line(number: np.ndarray) -> str:
    return ".-" if number.size <= FEW else "-"
