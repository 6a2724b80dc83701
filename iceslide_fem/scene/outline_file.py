"""The outline of a block as a file of polygons in the ice plane."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.columns import Wanted, read_columns

COLUMNS = (Wanted("x", "m"), Wanted("y", "m"), Wanted("ring", ""))
MOST_POINTS = 2000
SMALLEST, LARGEST = 1e-5, 0.3  # m


def read_outline(path: Path, key: str) -> tuple[Array, ...]:
    """Polygons (n, 2), m: the block seen from above, the outer one first, then its holes.

    The file has the columns x_m and y_m (or other units), and `ring` (an integer) if there are
    holes. The rows of a ring are the corners of one closed polygon in order. Lines that begin with
    # are comments. Otherwise raises SceneError with `key`.
    """
    return _read(path, key, path.stat().st_mtime_ns if path.exists() else 0)


@lru_cache(maxsize=4)  # a scene asks for its shape several times
def _read(path: Path, key: str, changed: int) -> tuple[Array, ...]:
    table, found = read_columns(path, key, COLUMNS, ("x", "y"))
    where, none = table.said, np.zeros(len(table.lines))
    rings: dict[float, list[tuple[float, float]]] = {}
    for ring, x, y in zip(found.get("ring", none), found["x"], found["y"], strict=True):
        rings.setdefault(float(ring), []).append((float(x), float(y)))
    polygons = [_polygon(where, points) for points in rings.values()]
    if not polygons:
        raise SceneError(f"{where} has no points")
    if sum(map(len, polygons)) > MOST_POINTS:
        raise SceneError(f"{where} has more than {MOST_POINTS} points; draw it more coarsely")
    polygons.sort(key=lambda ring: -abs(area(ring)))
    check_outline(where, polygons)
    return tuple(polygons)


def check_outline(where: str, polygons: Sequence[Array]) -> None:
    """Raise SceneError, beginning with `where`, if polygons are not an outline of a block.

    polygons: (n, 2), m, the outer one first.
    """
    size = float(np.ptp(polygons[0], axis=0).max())
    if not SMALLEST <= size <= LARGEST:
        raise SceneError(
            f"{where} is {size:g} m large; allowed: {SMALLEST:g} to {LARGEST:g} m, in metres"
        )
    _check_crossings(where, polygons)
    for hole in polygons[1:]:
        if not _inside(hole[0], polygons[0]):
            raise SceneError(f"{where} has two separate parts; allowed: one polygon and its holes")
        if any(other is not hole and _inside(hole[0], other) for other in polygons[1:]):
            raise SceneError(f"{where} has a hole within a hole")


def area(ring: Array) -> float:
    """Area of a polygon (n, 2), m2, negative if it runs clockwise."""
    x, y = ring.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _polygon(where: str, points: list[tuple[float, float]]) -> Array:
    ring = np.array(points)
    if not np.isfinite(ring).all():
        raise SceneError(f"{where}: coordinates are not all finite numbers")
    if len(ring) > 1 and np.array_equal(ring[0], ring[-1]):  # closed by hand
        ring = ring[:-1]
    if len(ring) < 3 or area(ring) == 0.0:
        raise SceneError(f"{where}: a polygon has three corners or more and covers an area")
    if (ring == np.roll(ring, 1, axis=0)).all(axis=1).any():
        raise SceneError(f"{where}: two corners that follow each other are the same")
    return ring


def _check_crossings(where: str, polygons: Sequence[Array]) -> None:
    """Raise SceneError if sides cross or touch other sides than their neighbours."""
    starts = np.concatenate(polygons)
    ends = np.concatenate([np.roll(ring, -1, axis=0) for ring in polygons])
    count = len(starts)
    following = np.concatenate(
        [
            first + np.roll(np.arange(len(ring)), -1)
            for first, ring in zip(np.cumsum([0, *map(len, polygons[:-1])]), polygons, strict=True)
        ]
    )

    def turn(a: Array, b: Array, c: Array) -> Array:
        one, other = b - a, c - a
        return np.asarray(np.sign(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]))

    a, b, c, d = starts[:, None], ends[:, None], starts[None], ends[None]
    crossing = (turn(a, b, c) * turn(a, b, d) <= 0.0) & (turn(c, d, a) * turn(c, d, b) <= 0.0)
    apart = (np.maximum(a, b) < np.minimum(c, d)) | (np.maximum(c, d) < np.minimum(a, b))
    crossing &= ~apart.any(axis=-1)
    number = np.arange(count)
    crossing[number, number] = crossing[number, following] = crossing[following, number] = False
    if crossing.any():
        x, y = 1e3 * starts[np.argwhere(crossing)[0][0]]
        raise SceneError(
            f"{where}: the outline crosses or touches itself near ({x:.4g}, {y:.4g}) mm"
        )


def _inside(point: Array, ring: Array) -> bool:
    """Whether a ray from the point crosses the polygon an odd number of times."""
    (x1, y1), (x2, y2) = ring.T, np.roll(ring, -1, axis=0).T
    between = (y1 > point[1]) != (y2 > point[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x1 + (point[1] - y1) / (y2 - y1) * (x2 - x1)
    return bool(np.count_nonzero(between & (point[0] < at)) % 2)
