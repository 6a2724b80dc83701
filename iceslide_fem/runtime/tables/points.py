"""Lists of points x, y and a value, as a map on their regular grid."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import column_unit

SAME = 1e-6  # of the extent: distance of positions that are the same
UNEVEN = 0.1  # of the spacing: distance of a point from its place on the grid
SPARSE = 4  # places per point of a grid, at most
_STEM = re.compile(r"[\s_\[(/].*")
_AXES = {  # of sensors, of Abaqus and of ParaView
    "x": {"x", "xcoord", "coord1", "coor1", "points:0"},
    "y": {"y", "ycoord", "coord2", "coor2", "points:1"},
}


class Points(NamedTuple):
    """Points of a table, (n,) each in the units of the file; units: of x, y, value, or None."""

    x: Array
    y: Array
    value: Array
    units: tuple[str | None, str | None, str | None]


def points_of(table: TextTable, places: tuple[int, int, int], unit: str) -> Points:
    """Points in the columns `places` of x, y and the value of the SI `unit`. Raises SceneError."""
    if table.width == len(places):
        x, y, value = table.numbers().T[list(places)]
    else:
        x, y, value = (table.column(i) for i in places)
    if np.isnan(x).any() or np.isnan(y).any():
        table.refuse("has points without x or y")
    names = (column_unit(table, i, si) for i, si in zip(places, ("m", "m", unit), strict=True))
    return Points(x, y, value, tuple(names))  # type: ignore[arg-type]


def named_columns(
    table: TextTable, unit: str, known: Collection[str]
) -> tuple[int, int, int] | None:
    """Columns of x, y and a value by their names; None if they have no x and y.

    The value has one of the `known` names, or else the only unit with the dimension of `unit`, or
    is the only other column. Raises SceneError if several could be it.
    """
    stems = [_STEM.sub("", name.strip()).replace("-", "").casefold() for name in table.heading]
    xs, ys = ([i for i, stem in enumerate(stems) if stem in _AXES[axis]] for axis in "xy")
    if len(xs) != 1 or len(ys) != 1:
        return None
    others = [i for i in range(len(stems)) if i not in (*xs, *ys)]
    named = [i for i in others if stems[i] in known]
    fitting = [i for i in others if unit and column_unit(table, i, unit) is not None]
    for found in (named, fitting, others):
        if len(found) == 1:
            return xs[0], ys[0], found[0]
    given = ", ".join(table.heading[i] for i in others) or "nothing"
    table.refuse(f"has points x and y with {given[:80]}; allowed: one column of values")


def on_grid(points: Points) -> tuple[Array, float, float] | None:
    """Values (rows, columns) by rising y and x, NaN without a point, and the spacing along x and y.

    None if the points do not lie on a regular grid.
    """
    x, y = _places(points.x), _places(points.y)
    if x is None or y is None:
        return None
    (columns, dx), (rows, dy) = x, y
    shape = rows.max() + 1, columns.max() + 1
    if shape[0] * shape[1] > SPARSE * len(rows):
        return None
    if np.unique(rows * shape[1] + columns).size < len(rows):
        return None
    values = np.full(shape, np.nan)
    values[rows, columns] = points.value
    return values, dx, dy


def check_places(points: Points, said: str) -> None:
    """Raise SceneError if all x or all y are the same, or two points have the same place."""
    for name, values in (("x", points.x), ("y", points.y)):
        if np.ptp(values) == 0.0:
            raise SceneError(f"{said}: all points have the same {name}")
    if len(np.unique(np.column_stack([points.x, points.y]), axis=0)) < len(points.x):
        raise SceneError(f"{said} has several points at one place")


def _places(values: Array) -> tuple[Index, float] | None:
    """Index of each position on a regular grid, and the grid's spacing; None if there is none."""
    levels = np.unique(values)
    extent = levels[-1] - levels[0]
    levels = levels[np.concatenate([[True], np.diff(levels) > SAME * extent])]
    distance = float(np.median(np.diff(levels)))
    count = round(extent / distance)
    step = extent / count  # rounding averages out over the whole grid
    number = np.rint((values - levels[0]) / step).astype(int)
    if np.abs((values - levels[0]) / step - number).max() > UNEVEN:
        return None
    return number, float(step)
