"""The straight block in 3-D: its profile swept across it, and cut edges swept along its sides.

Every lug has a cut edge around it. What is within its zone is a frame of four bars, which meet in
mitres, upright planes at 45 degrees; so two arcs of one radius meet in an ellipse. Within the frame
the lug is a box.
"""

from __future__ import annotations

from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.mesh.box import Grid, Span
from iceslide_fem.mesh.patches import ROUNDING, Patch, mesh_patches
from iceslide_fem.mesh.sections import edge_patches, profile_patches, rows_above, upright
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array

RUN = 3.0  # widths of a zone from a mitre in which cells are moved to meet it

Part = tuple[Array, IntArray]  # points (n, 3), m, and hexahedra (m, 8)


def swept(block: BlockShape, grid: Grid) -> Part:
    """Points (n, 3), m, and hexahedra (m, 8) of the straight block."""
    profile = profile_patches(block, grid)
    zone = float(grid.zone[-1][-1]) if grid.zone else 0.0
    parts: list[Part] = []
    for span in grid.across:
        if span.depth:
            parts.append(mesh_patches(_above_channel(grid, span, zone), span.middle))
            continue
        points, cells = mesh_patches(profile, span.middle)
        points[:, 1] = _mitred(points[:, 1], span, _short_of_zone(grid, points[:, 0]))
        parts.append((points, cells))
        for corner, way in span.corners:
            bar = edge_patches(corner, way, grid, block.cut)
            parts += [_bar(bar, lug, corner + way * zone) for lug in grid.columns if not lug.depth]
    return _joined(parts)


def _bar(patches: list[Patch], lug: Span, inner: float) -> Part:
    """A bar along x below the side of a lug, from y = `inner` on; its `patches` lie in y and z."""
    points, cells = mesh_patches(patches, lug.middle)
    points = points[:, [1, 0, 2]]
    points[:, 0] = _mitred(points[:, 0], lug, np.abs(points[:, 1] - inner))
    return points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]


def _above_channel(grid: Grid, channel: Span, zone: float) -> list[Patch]:
    """The profile above a channel, whose columns are those of the lugs' sides."""
    patches: list[Patch] = []
    for span in grid.columns:
        line = _mitred(span.middle, span, zone)
        patches += upright(line, rows_above(grid, max(span.depth, channel.depth)))
    return patches


def _short_of_zone(grid: Grid, x: Array) -> Array:
    """How far (m) places x in the zones of cut edges are from their ends: 0 within a lug's frame,
    a zone's width at the lug's end and beyond it.
    """
    knots = [[span.low, *span.middle[[0, -1]], span.high] for span in grid.columns]
    most = float(grid.zone[-1][-1]) if grid.zone else 0.0
    short = [[most, *([most] * 2 if span.depth else [0.0] * 2), most] for span in grid.columns]
    return np.interp(x, list(chain(*knots)), list(chain(*short)))


def _mitred(at: Array, span: Span, short: Array | float) -> Array:
    """Places in a span's middle, m, moved to where they are `short` of the end of its edges' zone.

    Those at its ends are moved by as much, those further inside less, and most not at all.
    """
    first, last = span.middle[0], span.middle[-1]
    zone = max(first - span.low, span.high - last)
    if zone == 0.0:
        return at
    run = min(RUN * zone, (last - first) / sum(span.edges))
    low, high = (np.clip(1.0 - way / run, 0.0, 1.0) for way in (at - first, last - at))
    return np.asarray(at + short * (span.edges[1] * high - span.edges[0] * low))


def _joined(parts: list[Part]) -> Part:
    """Parts as one, whose points at one place are one."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    points = np.concatenate([points for points, _ in parts])
    cells = np.concatenate([cells + start for (_, cells), start in zip(parts, starts, strict=True)])
    near = ROUNDING * float(np.ptp(points, axis=0).max())
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")  # of a place all of them
    first = np.arange(len(points))
    np.minimum.at(first, pairs.max(axis=1), pairs.min(axis=1))
    return points, first[cells]
