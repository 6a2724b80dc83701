"""How much of a rectangle facets of a plane cover."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from iceslide_fem.runtime.arrays import Array

Ranges = Sequence[tuple[float, float]]


def covered(corners: Array, ranges: Ranges) -> float:
    """Share of the rectangle (of the line in a slice) with these `ranges`, m, that convex facets
    with `corners` (n, k, d-1), m, cover, which do not overlap.
    """
    low, high = np.array(ranges).T
    whole = float(np.prod(high - low))
    inside = np.clip(corners, low, high)
    if corners.shape[2] == 1:
        return float(np.ptp(inside, axis=1).sum()) / whole
    cut = (inside != corners).any(axis=(1, 2))
    area = float(_areas(corners[~cut]).sum())
    area += sum(float(_areas(_clipped(one, ranges)[None])[0]) for one in corners[cut])
    return area / whole


def _areas(corners: Array) -> Array:
    """Of polygons (n, k, 2), by the shoelace formula."""
    x, y = np.moveaxis(corners - corners[:, :1], -1, 0)
    return 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))


def _clipped(polygon: Array, ranges: Ranges) -> Array:
    """What of a convex `polygon` (k, 2) is in the rectangle, by the method of Sutherland and
    Hodgman: cut off by one side after the other. A point outside where nothing is.
    """
    for axis, ends in enumerate(ranges):
        for sign, end in zip((1.0, -1.0), ends, strict=True):
            depth = sign * (polygon[:, axis] - end)
            kept = []
            for one, other, here, there in zip(
                polygon, np.roll(polygon, -1, axis=0), depth, np.roll(depth, -1), strict=True
            ):
                if here >= 0.0:
                    kept.append(one)
                if (here > 0.0 > there) or (here < 0.0 < there):
                    kept.append(one + (other - one) * here / (here - there))
            if not kept:
                return polygon[:1]
            polygon = np.array(kept)
    return polygon
