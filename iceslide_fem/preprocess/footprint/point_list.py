"""Lists of points x, y and a value, of sensors or of the nodes of a finite element model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import units_named
from iceslide_fem.runtime.tables.grid import is_list_of_points
from iceslide_fem.runtime.tables.points import (
    Points,
    check_places,
    named_columns,
    on_grid,
    points_of,
)
from iceslide_fem.runtime.units import to_si

VALUES = {"p", "pressure", "cpress", "pres", "z", "t", "temperature", "state", "value"}
PER_SPACING = 2  # pixels over the mean distance of scattered points
LONG = 2.5  # longest side of a triangle between scattered points, in the median of all longest
FEWEST = 12  # scattered points


class GivenMap(NamedTuple):
    """A map of a file.

    values: (ny, nx), first row on top, NaN without a point; units: those that the file names for
    them, or the one that they are in; size: (length, width) in m, if it is in the file; notes:
    sentences for the user; saturation: above which its sensors do not measure, Pa, if it says so.
    """

    values: Array
    units: Sequence[str] = ()
    size: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    saturation: float | None = None


def read_points(table: TextTable, unit: str) -> GivenMap | None:
    """The map of a list of points, x along the direction of travel; None if it is no list.

    Each point of a regular grid is a pixel. Between scattered points the value is linear on
    triangles. unit: SI, of the value. Raises SceneError.
    """
    columns = named_columns(table, unit, VALUES)
    if columns is None:
        if not is_list_of_points(table):
            return None
        columns = 0, 1, 2
    points = points_of(table, columns, unit)
    check_places(points, table.said)
    named = [points.units[2]] if points.units[2] else units_named(table.above, unit) if unit else []
    found = on_grid(points)
    if found is not None:
        values, dx, dy = found
        note = "a list of points on a regular grid is read, each as a pixel"
    else:
        values, dx, dy, widest = _scattered(points, table)
        note = (
            f"a list of {points.x.size} scattered points is read, with values linear between them; "
            f"grooves narrower than {widest:.3g} {points.units[0] or ''}".rstrip()
            + " are closed"
        )
    x_unit, y_unit = points.units[:2]
    rows, columns_ = values.shape
    size = None
    if x_unit is not None and y_unit is not None:
        size = columns_ * dx * to_si(f"1 {x_unit}", "m"), rows * dy * to_si(f"1 {y_unit}", "m")
    return GivenMap(values[::-1], named, size, (f"{note}; x is along the direction of travel",))


def _scattered(points: Points, table: TextTable) -> tuple[Array, float, float, float]:
    """Values linear on triangles between the points; sides of a pixel along x and y; widest gap."""
    from scipy.spatial import Delaunay

    x, y = points.x, points.y
    if x.size < FEWEST:
        table.refuse(f"has {x.size} scattered points; allowed: {FEWEST} or more, or a regular grid")
    apart = float(np.sqrt(np.ptp(x) * np.ptp(y) / x.size))
    shape = [max(2, round(PER_SPACING * np.ptp(along) / apart)) for along in (y, x)]
    dy, dx = np.ptp(y) / shape[0], np.ptp(x) / shape[1]
    rows, columns = np.indices(shape) + 0.5
    places = np.column_stack([(x.min() + dx * columns).ravel(), (y.min() + dy * rows).ravel()])
    mesh = Delaunay(np.column_stack([x, y]))
    corners = mesh.points[mesh.simplices]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    cell = mesh.find_simplex(places)
    widest = LONG * float(np.median(sides))
    inside = (cell >= 0) & (sides[cell] <= widest)
    here = cell[inside]
    part = mesh.transform[here]
    weights = np.einsum("nij,nj->ni", part[:, :2], places[inside] - part[:, 2])
    weights = np.column_stack([weights, 1.0 - weights.sum(axis=1)])
    values = np.full(places.shape[0], np.nan)
    values[inside] = (weights * points.value[mesh.simplices[here]]).sum(axis=1)
    return values.reshape(shape), float(dx), float(dy), widest
