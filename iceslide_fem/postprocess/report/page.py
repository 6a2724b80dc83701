"""Structure of a page, and its HTML file.

Sections have text, tables, charts and fields over time. Data of charts and fields are stored once,
compressed, beside plotly.js. Every chart has a sentence and a table for accessibility.
"""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import iceslide_fem
from iceslide_fem.runtime.files import replace_file

DIGITS = 6  # of drawn numbers
LONG = 2.0  # length over height of a map that needs the full width
FEW = 6  # largest number of curves in a legend above a chart
PIXELS = 260  # of a map along x at most: every n-th is drawn
DRAWN = 1500  # points of a curve at most
COLOURS = 24  # of a colour map
ROBUST = 98.0  # percentile at which colours end, because pressures are singular at an edge
LISTED = 12  # rows of the table below a chart at most
# Captions of the tables whose rows are all that was given.
OPTIONS, SCENES = "All options", "Scenes as resolved"


class Text(NamedTuple):
    """A paragraph; kind: "", "warning", "stopped" or "code"."""

    words: str
    kind: str = ""


class Cell(NamedTuple):
    """A cell of a table; key and value: of summary.json, for programs that read the page."""

    text: str
    key: str = ""
    value: Any = None


class Table(NamedTuple):
    """A table; the first column names its rows."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


class Curve(NamedTuple):
    """A curve of a chart; look: index of colour and stroke; marks: points instead of a line."""

    name: str
    x: ArrayLike
    y: ArrayLike
    look: int = 0
    marks: bool = False


class Band(NamedTuple):
    """A named, shaded interval of x."""

    name: str
    start: float
    end: float


class Chart(NamedTuple):
    """Curves over x with zoom; `says`: description in words.

    logarithmic: logarithmic axes, "", "y" or "xy".
    """

    name: str
    title: str
    says: str
    x: str
    y: str
    curves: Sequence[Curve]
    bands: Sequence[Band] = ()
    logarithmic: str = ""


class HeatMap(NamedTuple):
    """Values (ny, nx) over x and y, NaN without a value.

    range: ends of the colours, or None; classes: names of the values 1, 2 and so on; marked: places
    (ny, nx) that are hatched or grey, as `says` tells.
    """

    name: str
    title: str
    says: str
    x: str
    y: str
    unit: str
    places: tuple[ArrayLike, ArrayLike]
    values: ArrayLike
    colours: str = "viridis"
    equal: bool = False
    range: tuple[float, float] | None = None
    classes: Sequence[str] = ()
    marked: ArrayLike | None = None


class Fields(NamedTuple):
    """Drawings at `times` (ms), with a caption for each time; drawings: as in fields.py."""

    times: Sequence[float]
    moments: Sequence[str]
    drawings: Sequence[Mapping[str, Any]]


class Picture(NamedTuple):
    """A picture; png: its file in base64; says: description in words."""

    title: str
    says: str
    png: str


Part = Text | Table | Chart | HeatMap | Fields | Picture


class Section(NamedTuple):
    """A part of the page with a heading; name: its anchor."""

    name: str
    title: str
    parts: Sequence[Part]


class Page(NamedTuple):
    """A page; stopped: reason of an early end of its run, or ""."""

    title: str
    summary: str
    sections: Sequence[Section]
    stopped: str = ""


def write_page(path: Path, page: Page) -> Path:
    """Write the page to `path` atomically. Raises OutputError."""
    replace_file(path, html(page))
    return path


def html(page: Page) -> str:
    """The page as text."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("iceslide_fem.postprocess.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    folder = Path(__file__).parent
    return environment.get_template("page.html").render(
        page=page,
        kind_of=lambda part: type(part).__name__,
        listed=_listed,
        is_wide=_is_wide,
        style=(folder / "page.css").read_text("utf-8"),
        script=(folder / "page.js").read_text("utf-8"),
        plotly=_plotly(),
        numbers=_packed(json.dumps(_numbers(page), separators=(",", ":")).encode()),
        version=iceslide_fem.__version__,
        date=f"Page of {date.today():%d %B %Y}".replace(" 0", " "),
    )


Numbers = list[float | None]


def plain(values: ArrayLike) -> Numbers:
    """Numbers for the page: rounded to `DIGITS`, None for NaN and infinity."""
    flat = np.asarray(values, dtype=float).ravel().tolist()
    return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in flat]


def thinned(*columns: ArrayLike) -> list[np.ndarray]:
    """Columns of a curve thinned to `DRAWN` points; keeps the maximum of the last column."""
    arrays = [np.asarray(column, dtype=float) for column in columns]
    if arrays[0].size <= DRAWN:
        return arrays
    keep = np.linspace(0, arrays[0].size - 1, DRAWN).round().astype(int)
    keep = np.union1d(keep, [int(np.nanargmax(arrays[-1]))])
    return [array[keep] for array in arrays]


def colours(name: str) -> list[str]:
    """`COLOURS` of one of matplotlib's colour maps."""
    import matplotlib
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in matplotlib.colormaps[name](np.linspace(0, 1, COLOURS))]


def _numbers(page: Page) -> dict[str, Any]:
    """Data for the script, by the names of charts."""
    found: dict[str, Any] = {}
    for part in (part for section in page.sections for part in section.parts):
        if isinstance(part, Chart):
            found[part.name] = {
                "kind": "curves",
                "x": part.x,
                "y": part.y,
                "logarithmic": part.logarithmic,
                "bands": [list(band) for band in part.bands],
                "curves": [drawn_curve(curve) for curve in part.curves],
            }
        elif isinstance(part, HeatMap):
            (x, y), values = drawn(part)
            found[part.name] = {
                "kind": "map",
                "xs": x,
                "ys": y,
                "values": values,
                "marked": _marked(part),
                "colours": colours(part.colours),
                **{
                    key: getattr(part, key)
                    for key in ("x", "y", "unit", "equal", "range", "classes")
                },
            }
        elif isinstance(part, Fields):
            found["fields"] = {"moments": list(part.moments), "drawings": list(part.drawings)}
    return found


def drawn(part: HeatMap) -> tuple[list[Numbers], list[Numbers]]:
    """Places along x and y, and values (ny, nx), of the pixels that a page draws."""
    every = -(-np.shape(part.values)[1] // PIXELS)
    values = np.asarray(part.values, dtype=float)[::every, ::every]
    places = [plain(np.asarray(place)[::every]) for place in part.places]
    return places, [plain(row) for row in values]


def _marked(part: HeatMap) -> list[Numbers] | None:
    """1 at marked pixels, None elsewhere."""
    if part.marked is None:
        return None
    marks = np.where(np.asarray(part.marked) > 0, 1.0, np.nan)
    return drawn(part._replace(values=marks))[1]


def _is_wide(part: Chart | HeatMap) -> bool:
    """Whether a chart has the full width: a long map to scale, or many curves."""
    if isinstance(part, Chart):
        return len(part.curves) > FEW
    width, height = (float(np.ptp(np.asarray(place))) for place in part.places)
    return part.equal and width > LONG * height


def drawn_curve(curve: Curve) -> dict[str, Any]:
    """A curve with the points that a page draws."""
    x, y = thinned(curve.x, curve.y)
    return curve._asdict() | {"x": plain(x), "y": plain(y)}


def _listed(chart: Chart) -> Iterable[list[str]]:
    """Rows of the table below a chart: x, and linearly interpolated curves."""
    xs = [np.asarray(curve.x, dtype=float) for curve in chart.curves]
    whole = max(xs, key=lambda x: x.size)
    at = whole if whole.size <= LISTED else np.linspace(whole.min(), whole.max(), LISTED)
    for place in at:
        row = [f"{place:.4g}"]
        for curve, x in zip(chart.curves, xs, strict=True):
            order = np.argsort(x, kind="stable")
            y = np.asarray(curve.y, dtype=float)[order]
            value = np.interp(place, x[order], y, left=np.nan, right=np.nan)
            row.append(f"{value:.4g}" if math.isfinite(value) else "–")
        yield row


@cache
def _plotly() -> str:
    """plotly.js from the Python package plotly, compressed."""
    from plotly.offline import get_plotlyjs

    return _packed(get_plotlyjs().encode())


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 3, mtime=0)).decode()
