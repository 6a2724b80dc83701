"""Height maps as text: a matrix, points x, y, z, or an Esri grid; with their headers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.cells import TextTable, number
from iceslide_fem.runtime.tables.columns import has_index, units_named
from iceslide_fem.runtime.tables.grid import LARGEST_MAP, grid, read_text
from iceslide_fem.runtime.tables.layout import parse
from iceslide_fem.runtime.tables.points import check_places, named_columns, on_grid, points_of
from iceslide_fem.runtime.units import si_unit, to_si
from iceslide_fem.surfaces.height_map import HeightMap
from iceslide_fem.surfaces.instruments import read_instrument_text

_VALUE = re.compile(r"\s*([^:=\d]*?)\s*[:=]?\s*([-+0-9.,eE]+)\s*([^\s\d]*)\s*")
_UNIT_OF_KEY = re.compile(r"(.*?)\s*[\[(]\s*(.+?)\s*[\])]")
_HEIGHTS = re.compile(
    r"heights?|höhe|topograph\w*|values?|\bz\b|data|valor\w*|hodnot|einheiten|unités|^\W*units?\W+\S+$",
    re.IGNORECASE,
)
# "Width" and "Height" in Gwyddion's languages.
_WIDTHS = ("width", "breite", "largeur", "larghezza", "anchura", "largura", "šířka")
_TALLS = ("height", "höhe", "hauteur", "altezza", "altura", "výška")
_UNIT_OF_SIDES = re.compile(r"\s*xy?[\s_-]*units?\s*[:=]\s*(\S+)\s*", re.IGNORECASE)
_WHOLE = dict.fromkeys((*_WIDTHS, "x size", "x length", "x range", "length x"), 0)
_WHOLE |= dict.fromkeys((*_TALLS, "y size", "y length", "y range", "length y"), 1)
_ONE = {"pixel width": 0, "dx": 0, "x step": 0, "x spacing": 0, "x pixel size": 0, "spacing x": 0}
_ONE |= {"pixel height": 1, "dy": 1, "y step": 1, "y spacing": 1, "y pixel size": 1, "spacing y": 1}
_BOTH = {"pixel size", "pixel", "pixelsize", "spacing", "sampling interval", "lateral resolution"}
_BOTH |= {"xy resolution", "xy calibration", "pixelgröße", "pixelgrösse", "cellsize"}
_ESRI = re.compile(
    r"\s*(ncols|nrows|[xy]ll(?:corner|center)|cellsize|d[xy]|nodata_value)[ \t]+(\S+)", re.I
)


def read_text_map(path: Path, unit: float | None) -> HeightMap:
    """The map in a text file. unit: of heights without one, m, by default 1. Raises SceneError."""
    text = read_text(path, "the map", LARGEST_MAP)
    if re.match(r"\s*(ncols|nrows)[ \t]+[0-9]", text, re.IGNORECASE):
        return _esri(text, str(path), unit)
    if (found := read_instrument_text(text, str(path), unit)) is not None:
        return found
    table = parse(text, str(path))
    places = _point_columns(table)
    if places is not None:
        return _points(table, places, unit)
    values, left_out = grid(table)
    lines = [*table.above, *(table.heading if len(set(table.heading)) == 1 else ())]
    if table.separator in (",", ";"):  # of names and values in cells of their own
        lines = [line.replace('"', "").replace(table.separator, " ") for line in lines]
    of_heights = (line for line in lines if _HEIGHTS.search(line) and not _VALUE.fullmatch(line))
    factor, notes = _height_unit(units_named(of_heights, "m"), str(path), unit)
    sides = _sides(lines, values.shape)
    notes += left_out
    if sides is not None:
        notes += (f"its header gives pixels of {1e6 * sides[0]:.4g} x {1e6 * sides[1]:.4g} um",)
    return HeightMap(values * factor, sides, notes)


def _height_unit(
    named: Sequence[str], said: str, option: float | None
) -> tuple[float, tuple[str, ...]]:
    """The unit of heights (m): of the file, else the option, else 1 m; and a note.

    Raises SceneError if they differ.
    """
    units = {to_si(f"1 {unit}", "m"): unit for unit in named}
    if len(units) > 1 and option is None:
        raise SceneError(
            f"{said} names the units {' and '.join(units.values())} of heights; --height-unit says "
            "which"
        )
    if len(units) != 1:
        return option or 1.0, ()
    ((factor, name),) = units.items()
    if option is not None and abs(option / factor - 1.0) > 1e-9:
        raise SceneError(f"--height-unit contradicts {said}, whose heights are in {name}")
    return factor, (f"its header has heights in {name}",)


def _sides(lines: Sequence[str], shape: tuple[int, ...]) -> tuple[float, float] | None:
    """Sides of a pixel (m) from a header; None without them."""
    sides: list[float | None] = [None, None]
    common = next((m[1] for line in lines if (m := _UNIT_OF_SIDES.fullmatch(line))), "")
    for line in lines:
        if (match := _VALUE.fullmatch(line)) is None:
            continue
        key, digits, unit = match.groups()
        if (bracketed := _UNIT_OF_KEY.fullmatch(key)) is not None:
            key, unit = bracketed[1], bracketed[2]
        given = si_unit(unit or common, "m")
        try:
            length = number(digits, "," if "," in digits else ".")
        except ValueError:
            continue
        if given is None:
            continue
        length = to_si(f"{length!r} {given}", "m")
        key = re.sub(r"[\s_\-]+", " ", key.casefold()).strip()
        if key in _WHOLE:
            axis = _WHOLE[key]
            sides[axis] = length / shape[1 - axis]
        elif key in _ONE:
            sides[_ONE[key]] = length
        elif key in _BOTH:
            sides = [length, length]
    x, y = sides
    if x is None and y is None:
        return None
    return (x if x is not None else y or 0.0, y if y is not None else x or 0.0)


def _point_columns(table: TextTable) -> tuple[int, int, int] | None:
    """Columns of x, y, z of a table of points, by name or as three columns of many rows."""
    if (named := named_columns(table, "m", {"z"})) is not None:
        return named
    if table.width == 4 and has_index(table):
        return 1, 2, 3
    return (0, 1, 2) if table.width == 3 and len(table.lines) > 3 else None


def _points(table: TextTable, places: tuple[int, int, int], option: float | None) -> HeightMap:
    """A map from points x, y, z on a regular grid; positions without a point are missing."""
    points = points_of(table, places, "m")
    named = points.units
    given = [named[2]] if named[2] is not None else units_named(table.above, "m")
    z_unit, notes = _height_unit(given, table.said, option)
    x_unit, y_unit = (to_si(f"1 {unit}", "m") if unit is not None else z_unit for unit in named[:2])
    if any(named):
        units = ", ".join(
            f"{axis} in {unit}" for axis, unit in zip("xyz", named, strict=True) if unit
        )
        notes = (f"its heading has {units}",)
    check_places(points, table.said)
    if (found := on_grid(points)) is None:
        raise SceneError(f"{table.said}: its points do not lie on a regular grid")
    heights, dx, dy = found
    return HeightMap(heights * z_unit, (dx * x_unit, dy * y_unit), notes)


def _esri(text: str, said: str, unit: float | None) -> HeightMap:
    """An Esri ASCII grid: lengths and heights in one unit, first row on top."""
    lines = text.splitlines()
    head: dict[str, float] = {}
    while lines and (match := _ESRI.match(lines[0])) is not None:
        try:
            head[match[1].casefold()] = number(match[2].replace(",", "."))
        except ValueError:
            raise SceneError(f'{said}: {match[1]} = "{match[2]}" is not a number') from None
        del lines[0]
    for key in ("ncols", "nrows"):
        if not head.get(key, 0.0) >= 1.0:
            raise SceneError(f"{said} has no {key} in its header")
    dx, dy = (head.get(key, head.get("cellsize")) for key in ("dx", "dy"))
    if dx is None or dy is None:
        raise SceneError(f"{said} has no cellsize in its header")
    shape = int(head["nrows"]), int(head["ncols"])
    body = " ".join(lines)
    cells, decimal = body.split(), "," if "," in body and "." not in body else "."
    if len(cells) != shape[0] * shape[1]:
        raise SceneError(
            f"{said} has {len(cells)} heights; its header says {shape[0]} rows of {shape[1]}"
        )
    values = []
    for cell in cells:
        try:
            values.append(number(cell, decimal))
        except ValueError:
            raise SceneError(f'{said}: "{cell[:40]}" is not a number') from None
    heights = np.array(values).reshape(shape)
    heights[heights == head.get("nodata_value", -9999.0)] = np.nan
    factor = 1.0 if unit is None else unit
    note = "its cellsize and heights are taken to be in " + (
        "m (--height-unit says otherwise)" if unit is None else "the unit of --height-unit"
    )
    return HeightMap(heights * factor, (dx * factor, dy * factor), (note,))
