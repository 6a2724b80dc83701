"""Nested dissection: an order of elimination from where the points of a mesh are.

The mesh is cut in two, and each part again; what parts two is eliminated after both (A. George,
SIAM J. Numer. Anal. 10 (1973) 345). All parts of a level are cut at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array

# Parts of so many points are left whole; the others are cut at one of these shares of their points.
SMALL, SHARES = 16, (0.4, 0.45, 0.5, 0.55, 0.6)
# A cut is the dearer the more points it needs, and the less equal what it leaves: at worst by that.
UNEQUAL = 2.0
LOW, HIGH, BETWEEN = 0, 1, 2  # where the cut has a point; as digits they are in order
LEVELS = 31  # of two binary digits each

Numbers = NDArray[np.intp]


def dissected(points: Array, first: NDArray[np.int32], second: NDArray[np.int32]) -> Numbers:
    """The numbers of the `points` (n, d) in their order of elimination.

    Those `first` and `second` of each pair are coupled; pairs are there both ways round.
    """
    path = np.zeros(len(points), dtype=np.int64)
    part = np.zeros(len(points), dtype=np.intp)  # -1 between them
    for level in range(LEVELS):
        cut = _cut(points, part, first, second)
        if not cut.any():
            break
        path += cut << 2 * (LEVELS - 1 - level)
        part = np.where((part < 0) | (cut == BETWEEN), -1, 2 * part + cut)
        known, part = np.unique(part, return_inverse=True)
        part = part.reshape(-1) - int(known[0] < 0)
        together = (part[first] == part[second]) & (part[first] >= 0)
        first, second = first[together], second[together]
    return np.argsort(path, kind="stable")


def _cut(
    points: Array, part: Numbers, first: NDArray[np.int32], second: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Where the best cut of its part has each point: of all axes, shares, and either side's points
    as those between. LOW where there is none.
    """
    inside = np.flatnonzero(part >= 0)
    sizes = np.bincount(part[inside])
    ends = np.cumsum(sizes) + (part.size - inside.size)
    least, best = np.full(sizes.size, np.inf), np.zeros(len(points), dtype=np.int64)
    for x in points.T:
        ordered = x[np.lexsort((x, part))]
        for share in SHARES:
            at = ordered[ends - sizes + (share * (sizes - 1)).astype(np.intp)]
            high = np.zeros(len(points), dtype=bool)
            high[inside] = x[inside] > at[part[inside]]
            across = high[second] & ~high[first]
            for between in (first[across], second[across]):
                cut = high.astype(np.int64)
                cut[between] = BETWEEN
                kinds = np.bincount(3 * part[inside] + cut[inside], minlength=3 * sizes.size)
                low, above, parting = kinds.reshape(-1, 3).T
                cost = parting * (1.0 + UNEQUAL * np.abs(low - above) / sizes)
                cost[(sizes <= SMALL) | (low == 0) | (above == 0)] = np.inf
                better = cost < least
                least[better] = cost[better]
                chosen = inside[better[part[inside]]]
                best[chosen] = cut[chosen]
    return best
