"""The outline of a tread block from the picture.

The contact patch is smoothed over SMOOTHING pixels. Its contour is simplified: corners closer than
TOLERANCE pixels to the line without them are dropped. The outline is then scaled to the patch's
area.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from contourpy import FillType, contour_generator
from scipy.ndimage import gaussian_filter

from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.outline_file import area, check_outline

SMOOTHING = 1.0  # pixels, standard deviation of a Gaussian
TOLERANCE = 0.5  # pixels
SMALLEST_HOLE = 6.0  # pixels, below that it is noise


def patch_outline(patch: Mask, dx: float, dy: float) -> tuple[Array, ...]:
    """Polygons (n, 2), m, of a patch (ny, nx) with pixels dx, dy (m): the outer one, then holes.

    The origin is the middle of the patch's frame. Empty if no polygon can be drawn.
    """
    density = gaussian_filter(np.pad(patch.astype(float), 4), SMOOTHING)
    generator: Any = contour_generator(z=density, fill_type=FillType.OuterOffset)
    points, offsets = generator.filled(0.5, np.inf)[:2]
    parts = [
        [ring[begin:end] for begin, end in zip(cuts[:-1], cuts[1:], strict=True)]
        for ring, cuts in zip(points, offsets, strict=True)
    ]
    if not parts:
        return ()
    outer, *holes = max(parts, key=lambda rings: abs(area(rings[0])))
    kept = [outer, *(hole for hole in holes if abs(area(hole)) >= SMALLEST_HOLE)]
    ny, nx = patch.shape
    middle = np.array([nx - 1, ny - 1]) / 2 + 4.0
    drawn = [simplified(ring) - middle for ring in kept]
    if min(map(len, drawn)) < 3:  # a patch of one or two pixels
        return ()
    within = abs(area(drawn[0])) - sum(abs(area(hole)) for hole in drawn[1:])
    growth = np.sqrt(np.count_nonzero(patch) / within)  # chords cut off a part of every arc
    rings = tuple(growth * ring * [dx, dy] for ring in drawn)
    try:
        check_outline("the block's outline", rings)
    except SceneError:  # simplification made it touch itself
        return ()
    return rings


def simplified(ring: Array, tolerance: float = TOLERANCE) -> Array:
    """A closed polygon (n, 2) simplified to a `tolerance` (Ramer, Douglas and Peucker).

    The algorithm starts from the two corners that are farthest apart.
    """
    if np.array_equal(ring[0], ring[-1]):
        ring = ring[:-1]
    ring = np.roll(ring, -int(np.argmax(((ring - ring.mean(axis=0)) ** 2).sum(axis=1))), axis=0)
    far = int(np.argmax(((ring - ring[0]) ** 2).sum(axis=1)))
    closed = np.concatenate([ring, ring[:1]])
    kept = {0, far}
    open_ends = [(0, far), (far, len(ring))]
    while open_ends:
        first, last = open_ends.pop()
        if last - first < 2:
            continue
        way = closed[last] - closed[first]
        between = closed[first + 1 : last] - closed[first]
        across = np.abs(between[:, 0] * way[1] - between[:, 1] * way[0]) / np.hypot(*way)
        if across.max() > tolerance:
            corner = first + 1 + int(across.argmax())
            kept.add(corner)
            open_ends += [(first, corner), (corner, last)]
    return ring[sorted(kept)]


def outline_text(rings: tuple[Array, ...], pixel: float) -> str:
    """Text of the CSV file for `rubber.outline`; pixel: accuracy of the outline, m."""
    rows = [
        f"{x:.6g},{y:.6g},{number}"
        for number, ring in enumerate(rings, start=1)
        for x, y in ring.tolist()
    ]
    head = (
        f"# The contact of a block, smoothed over a pixel of {1e3 * pixel:.3g} mm and drawn "
        f"to within half of it.\n"
    )
    return head + "\n".join(["x_m,y_m,ring", *rows]) + "\n"
