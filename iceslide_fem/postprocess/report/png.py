"""Charts and maps of a page as pictures, by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from iceslide_fem.postprocess.report.page import Chart, HeatMap

DPI = 120
TICKS = 5  # intervals of an axis: ticks take most of the time of a picture
PANEL = 6.2, 4.6  # inches
LEFT, BELOW, ABOVE, BETWEEN_ROWS = 0.9, 0.6, 0.8, 0.95  # inches
BESIDE, BESIDE_MAPS = (0.3, 0.95), (0.8, 1.5)  # right of the last panel, and between two
COLOURS = ("#0072B2", "#B34700", "#00795A", "#7A4A9E", "#444444", "#8A6100")  # as on a page
STROKES = ("-", "--", ":", "-.", (0, (8, 3)), (0, (8, 3, 1, 3)))
SHADES = ((0.0, 0.0, 0.0, 0.0), (0.34, 0.71, 0.91, 0.16), (0.90, 0.62, 0.0, 0.18))
MARKS = "osD^vP"
NO_VALUE = "#c4c8cc"
BLUE, ORANGE, GREEN, RED, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7"
SMALLEST, LARGEST = 1e-3, 1e4  # between them logarithmic axes have plain numbers
NARROW, WIDE = 5.0, 300.0  # ratios of their ends up to which ticks are not decades alone
NAMED = 16  # curves in a legend at most
HATCHED = 200  # cells along a side of marked places at most


def save_png(parts: Sequence[Chart | HeatMap], path: Path, title: str = "") -> None:
    """Write `parts` as panels of one picture with a `title`. Raises OSError."""
    figure = figure_of(parts)
    figure.suptitle(title, fontsize=13)
    figure.savefig(path, dpi=DPI, pil_kwargs={"compress_level": 1})


def figure_of(parts: Sequence[Chart | HeatMap]) -> Figure:
    """One figure with a panel for each part, two or three side by side."""
    columns = len(parts) if len(parts) < 4 else 2 if len(parts) == 4 else 3
    rows = -(-len(parts) // columns)
    figure = Figure(figsize=(PANEL[0] * columns, PANEL[1] * rows))
    beside = BESIDE_MAPS if any(isinstance(part, HeatMap) for part in parts) else BESIDE
    left, right, wspace = _spread(columns, PANEL[0], LEFT, *beside)
    bottom, top, hspace = _spread(rows, PANEL[1], BELOW, ABOVE, BETWEEN_ROWS)
    figure.subplots_adjust(left, bottom, right, top, wspace, hspace)
    panels = list(figure.subplots(rows, columns, squeeze=False).flat)
    for panel, part in zip(panels, parts, strict=False):
        panel.set(xlabel=part.x, ylabel=part.y)
        panel.set_title(part.title, fontsize=11, y=1.0)  # its own place takes long to find
        panel.locator_params(nbins=TICKS)
        if isinstance(part, HeatMap):
            _map(panel, part)
        else:
            _curves(panel, part)
    for panel in panels[len(parts) :]:
        panel.set_axis_off()
    return figure


def _spread(
    count: int, size: float, before: float, after: float, between: float
) -> tuple[float, float, float]:
    """Edges of `count` panels as fractions of their figure, and their distance over their size.

    Without a layout engine, which takes as long as drawing; size of a panel with what is around it,
    and distances: inches.
    """
    whole = count * size
    panel = (whole - before - after - (count - 1) * between) / count
    return before / whole, 1.0 - after / whole, between / panel


def _curves(panel: Axes, chart: Chart) -> None:
    named = len(chart.curves) > 1
    for curve in chart.curves:
        look: dict[str, Any] = {
            "color": COLOURS[curve.look % 6],
            "label": curve.name if named else None,
        }
        if curve.marks:
            panel.plot(curve.x, curve.y, MARKS[curve.look % 6], markersize=4, **look)
        else:
            panel.plot(curve.x, curve.y, linestyle=STROKES[curve.look // 6 % 6], **look)
    for name in chart.logarithmic:
        panel.set(**{f"{name}scale": "log"})
        _plain_ticks(getattr(panel, f"{name}axis"))
    if "y" not in chart.logarithmic:
        low = min(
            (np.nanmin(curve.y) for curve in chart.curves if np.isfinite(curve.y).any()), default=0
        )
        if low >= 0.0:
            panel.set_ylim(bottom=0.0)
    for number, band in enumerate(chart.bands):
        shade = SHADES[number % 3]
        label = band.name if shade[-1] else None
        panel.axvspan(band.start, band.end, color=shade, zorder=-1, label=label)
    panel.grid(alpha=0.25)
    if panel.get_legend_handles_labels()[1] and len(chart.curves) <= NAMED:
        panel.legend(fontsize=7)


def _plain_ticks(axis: Axis) -> None:
    """Plain numbers on a logarithmic axis: few round ones, or 1, 2 and 5 of each decade."""
    low, high = axis.get_view_interval()
    if low < SMALLEST or high > LARGEST:
        return
    axis.set_major_formatter("{x:g}")
    if high < NARROW * low:
        axis.set_major_locator(MaxNLocator(TICKS))
        axis.set_minor_locator(NullLocator())
    elif high < WIDE * low:
        axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        axis.set_minor_formatter("{x:g}")


def _map(panel: Axes, part: HeatMap) -> None:
    x, y = (np.asarray(place, dtype=float) for place in part.places)
    values = np.asarray(part.values, dtype=float)
    known = values[np.isfinite(values)]
    least, most = (known.min(), known.max()) if known.size else (0.0, 1.0)
    low, high = part.range or (least, most)
    panel.set_facecolor(NO_VALUE)
    look: dict[str, Any] = {"cmap": part.colours, "vmin": low, "vmax": high}
    if part.equal:
        edges = (_ends(place) for place in (x, y))
        extent = (*next(edges), *next(edges))
        look |= {"interpolation": "nearest", "interpolation_stage": "data"}
        drawn: Any = panel.imshow(values, origin="lower", extent=extent, **look)
    else:
        drawn = panel.pcolormesh(x, y, values, shading="nearest", **look)
    beyond = ("neither", "min", "max", "both")[int(least < low) + 2 * int(most > high)]
    bar = panel.figure.colorbar(drawn, ax=panel, label=part.unit, extend=beyond, shrink=0.9)
    if part.classes:
        bar.set_ticks(range(1, 1 + len(part.classes)), labels=list(part.classes))
    if part.marked is not None and min(values.shape) > 1:
        every = tuple(slice(None, None, -(-count // HATCHED)) for count in values.shape)
        places = np.asarray(part.marked, dtype=float)[every]
        panel.contourf(
            x[every[1]], y[every[0]], places, levels=[0.5, 1.5], colors="none", hatches=["////"]
        )


def _ends(places: np.ndarray) -> tuple[float, float]:
    """Outer edges of equal cells around `places`."""
    half = 0.5 * (places[1] - places[0]) if places.size > 1 else 0.5
    return float(places[0] - half), float(places[-1] + half)
