"""Figures as PNG files, drawn once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image


def write_png(figure: Figure, path: Path, dpi: float) -> None:
    """Write the figure, whose ground is opaque, to `path`.

    matplotlib's `savefig` draws a figure with a layout engine twice, the first time for its layout
    alone, which a drawing makes anyway; and a fourth channel would be written for nothing.
    """
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    picture.save(path, "PNG", dpi=(dpi, dpi), compress_level=3)
