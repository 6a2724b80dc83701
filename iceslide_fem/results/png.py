"""Figures as PNG files, drawn once."""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


def write_png(figure: Figure, path: Path, dpi: float) -> None:
    """Write the figure to `path`.

    matplotlib's `savefig` draws a figure with a layout engine twice, the first time for its layout
    alone, which a drawing makes anyway.
    """
    figure.set_dpi(dpi)
    FigureCanvasAgg(figure).print_png(path)
