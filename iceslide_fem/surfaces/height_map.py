"""A height map of a file: heights, sides of its pixels, and notes on the file."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import distance_transform_edt

from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError

SQUARE = 1e-3  # relative difference of a pixel's sides
LONGEST = 10.0  # largest ratio of sides that is resampled to squares
# Of a value that marks missing heights: distance from all others, in ranges of these; or least
# fraction, least multiple of the next frequent value, and least step to its neighbours over others.
FAR, FREQUENT, MORE, STEEP = 3.0, 0.01, 10, 3.0


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


def without_marks(given: HeightMap, said: str) -> HeightMap:
    """The map with one value that marks missing heights replaced by NaN, and a note on it.

    Such a value is far from all others, or it is frequent and stands apart from the heights beside
    it. A frequent value that continues its neighbours is a flat place, and kept with a note. Raises
    SceneError if heights are infinite or all missing.
    """
    heights = given.heights
    if np.isinf(heights).any() or not np.isfinite(heights).any():
        raise SceneError(f"{said} has heights that are infinite, or none at all")
    values, counts = np.unique(heights[np.isfinite(heights)], return_counts=True)
    if values.size < 4:
        return given
    number = counts.sum()
    for at, others in ((0, values[1:]), (-1, values[:-1])):
        far = abs(values[at] - others[0 if at == 0 else -1]) > FAR * np.ptp(others)
        if counts[at] > 1 and far:
            return _marked(given, float(values[at]), counts[at] / number, "far from all others")
    second, most = np.sort(counts)[-2:]
    value, fraction = float(values[counts.argmax()]), most / number
    if fraction < FREQUENT or most < MORE * second:
        return given
    if _jump(heights, heights == value) > STEEP:
        return _marked(given, value, fraction, "apart from those beside them")
    note = (
        f"{fraction:.1%} of its heights are the same, {1e6 * value:.5g} um, and flat places: if "
        "these are missing heights or the end of the instrument's range, k, D and H_V are wrong"
    )
    return given._replace(notes=(*given.notes, note))


def _marked(given: HeightMap, value: float, fraction: float, where: str) -> HeightMap:
    heights = np.where(given.heights == value, np.nan, given.heights)
    note = (
        f"{fraction:.2%} of its heights are exactly {value:.6g} m, {where}: they are taken for "
        "missing ones"
    )
    return given._replace(heights=heights, notes=(*given.notes, note))


def _jump(heights: Array, same: Mask) -> float:
    """Median step at the rim of the pixels `same`, over that between other neighbours."""
    at_rim, elsewhere = [], []
    for axis in (0, 1):
        steps = np.abs(np.diff(heights, axis=axis))
        inside = np.diff(same.astype(np.int8), axis=axis)
        at_rim.append(steps[(inside != 0) & np.isfinite(steps)])
        both = same.take(range(1, same.shape[axis]), axis) | same.take(
            range(same.shape[axis] - 1), axis
        )
        elsewhere.append(steps[~both & np.isfinite(steps)])
    rim, usual = np.concatenate(at_rim), np.concatenate(elsewhere)
    if rim.size == 0 or usual.size == 0:
        return 0.0
    return float(np.median(rim) / max(float(np.median(usual)), 1e-300))
