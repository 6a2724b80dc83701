"""A height map of a file: heights, sides of its pixels, and notes on the file."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import distance_transform_edt

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

SQUARE = 1e-3  # relative difference of a pixel's sides
LONGEST = 10.0  # largest ratio of sides that is resampled to squares
FAR = 100.0  # distance of a missing-value mark from all other heights, in ranges of these


class HeightMap(NamedTuple):
    """heights: (rows, columns), m, NaN if missing; sides: of a pixel along x and y, m, or None.

    notes: sentences for the user.
    """

    heights: Array
    sides: tuple[float, float] | None
    notes: tuple[str, ...] = ()


def squared(given: HeightMap, said: str) -> HeightMap:
    """The map on square pixels, by cubic splines along the longer side of a pixel.

    A height beside a missing one becomes missing. Raises SceneError if a side is more than ten
    times as long as the other.
    """
    assert given.sides is not None
    dx, dy = given.sides
    if abs(dx - dy) <= SQUARE * dy:
        return given
    axis, coarse, fine = (1, dx, dy) if dx > dy else (0, dy, dx)
    if coarse > LONGEST * fine or given.heights.shape[axis] < 4:
        raise SceneError(
            f"{said} has pixels of {1e6 * dx:.4g} x {1e6 * dy:.4g} um; allowed: sides up to "
            f"{LONGEST:g} times as long as the other, and 4 pixels or more along the longer one"
        )
    count = given.heights.shape[axis]
    there = coarse * np.arange(count)
    wanted = np.arange(0.0, there[-1] * (1.0 + 1e-9), fine)
    missing = ~np.isfinite(given.heights)
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    heights = CubicSpline(there, given.heights[tuple(nearest)], axis=axis)(wanted)
    before = np.minimum((wanted / coarse * (1.0 + 1e-12)).astype(int), count - 1)
    after = np.minimum(np.ceil(wanted / coarse * (1.0 - 1e-12)).astype(int), count - 1)
    heights[missing.take(before, axis) | missing.take(after, axis)] = np.nan
    note = (
        f"its pixels of {1e6 * dx:.4g} x {1e6 * dy:.4g} um are made square, {1e6 * fine:.4g} um, "
        f"by cubic splines along {'x' if axis == 1 else 'y'}"
    )
    return HeightMap(heights, (fine, fine), (*given.notes, note))


def check_heights(heights: Array, said: str) -> None:
    """Raise SceneError if heights are infinite, all missing, or contain a missing-value mark."""
    if np.isinf(heights).any() or not np.isfinite(heights).any():
        raise SceneError(f"{said} has heights that are infinite, or none at all")
    finite = heights[np.isfinite(heights)]
    for extreme in (float(finite.min()), float(finite.max())):
        others = finite[finite != extreme]
        count = finite.size - others.size
        if count < 2 or others.size < 2 or not np.ptp(others) > 0.0:
            continue
        outside = min(abs(extreme - float(others.min())), abs(extreme - float(others.max())))
        if outside > FAR * float(np.ptp(others)):
            raise SceneError(
                f"{said} has the height {extreme:.6g} m at {count} places, far from all others: if "
                "it marks missing ones, leave those empty, or write NaN"
            )
