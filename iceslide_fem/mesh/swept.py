"""The straight block: patches of its profile, and in 3-D their sweeps and cut edges.

Every lug of a block has a cut edge around it. The zone of this edge is a frame of four bars. Bars
meet in mitres, vertical planes at 45 degrees, so two arcs of one radius meet in an ellipse. Within
the frame the lug is a box.
"""

from __future__ import annotations

from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.mesh.box import EdgeCells, Grid, Span
from iceslide_fem.mesh.grid import SAME_POINT, Lines, Patch, Point, even, mesh_patches, rectangle
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array

NEAR = 1e-9  # of the height
# Distance of the point where the patches at an arc meet from the arc's middle; distances of the
# middles of an arc and of a 45 degree chamfer from the corner, in radii.
MEETING = 0.5
MIDDLE = {False: 1.0 - 0.5**0.5, True: 0.5}
RUN = 3.0  # zone widths from a mitre over which cells are distorted

Part = tuple[Array, IntArray]  # points (n, 3), m, and hexahedra (m, 8)


def profile_patches(block: BlockShape, grid: Grid) -> list[Patch]:
    """Patches of the profile; also used across the sliding direction."""
    patches: list[Patch] = []
    for span in grid.columns:
        patches += upright(span.middle, rows_above(grid, span.depth))
        for corner, sign in span.corners:
            patches += edge_patches(corner, sign, grid, block.cut)
    return patches


def upright(line: Lines, rows: list[Lines]) -> list[Patch]:
    """Rectangles one above the other."""
    return [rectangle(line, row) for row in rows]


def rows_above(grid: Grid, depth: float) -> list[Lines]:
    """The rows of z above the end of a cut of this depth, m."""
    return [row for row in grid.rows if row[-1] > depth * (1.0 + NEAR)]


def edge_patches(corner: float, sign: int, grid: Grid, cut: bool) -> list[Patch]:
    """Patches within the zone of a cut edge, up to the plate."""
    assert grid.edge is not None
    rows = grid.rows[len(grid.zone) :]
    columns = [corner + sign * line for line in grid.zone]
    above = [patch for line in columns for patch in upright(line[::sign], rows)]
    return [*_lowest_patches(corner, sign, grid.edge, cut), *above]


def _lowest_patches(x: float, sign: int, edge: EdgeCells, cut: bool) -> list[Patch]:
    """The three patches at a cut edge, whose sharp corner would be at (x, 0).

    Two patches lie along the cut, one with the bottom beside it and one with the wall above it. A
    third patch fills the inner corner of the zone. All three meet at a point.
    """
    r, (layer, zone) = edge.radius, (lines[-1] for lines in edge.zone)

    def at(along: float, up: float) -> Point:
        return float(x + sign * along), float(up)

    middle = MIDDLE[cut] * r
    meeting = middle + MEETING * r
    centre = None if cut else at(r, r)
    far, bottom, half = at(zone, 0.0), at(r, 0.0), at(middle, middle)
    wall, high, inner = at(0.0, r), at(0.0, zone), at(zone, zone)
    lower, upper, heart = at(zone, layer), at(layer, zone), at(meeting, meeting)
    outwards = even(half, heart, edge.layer)
    down, over = even(heart, lower, edge.along), even(heart, upper, edge.along)
    return [
        (
            [even(far, bottom, edge.arc), even(bottom, half, edge.arc, centre)],
            [outwards],
            [down],
            [even(lower, far, edge.layer)],
        ),
        (
            [even(inner, lower, edge.along)],
            [down.reversed()],
            [over],
            [even(upper, inner, edge.along)],
        ),
        (
            [even(half, wall, edge.arc, centre), even(wall, high, edge.arc)],
            [even(high, upper, edge.layer)],
            [over.reversed()],
            [outwards.reversed()],
        ),
    ]


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
        for corner, sign in span.corners:
            bar = edge_patches(corner, sign, grid, block.cut)
            parts += [_bar(bar, lug, corner + sign * zone) for lug in grid.columns if not lug.depth]
    return _joined(parts)


def _bar(patches: list[Patch], lug: Span, inner: float) -> Part:
    """A bar along x at the side of a lug, from y = `inner` outwards; patches: in y and z."""
    points, cells = mesh_patches(patches, lug.middle)
    points = points[:, [1, 0, 2]]
    points[:, 0] = _mitred(points[:, 0], lug, np.abs(points[:, 1] - inner))
    return points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]


def _above_channel(grid: Grid, channel: Span, zone: float) -> list[Patch]:
    """The profile above a channel, with the columns of the lugs' sides."""
    patches: list[Patch] = []
    for span in grid.columns:
        line = _mitred(span.middle, span, zone)
        patches += upright(line, rows_above(grid, max(span.depth, channel.depth)))
    return patches


def _short_of_zone(grid: Grid, x: Array) -> Array:
    """Distance (m) of x from the inner end of a cut edge's zone.

    0 within a lug's frame, the width of the zone at the lug's end and beyond.
    """
    knots = [[span.low, *span.middle[[0, -1]], span.high] for span in grid.columns]
    most = float(grid.zone[-1][-1]) if grid.zone else 0.0
    short = [[most, *([most] * 2 if span.depth else [0.0] * 2), most] for span in grid.columns]
    return np.interp(x, list(chain(*knots)), list(chain(*short)))


def _mitred(at: Array, span: Span, short: Array | float) -> Array:
    """Positions in a span's middle, m, moved to meet mitres.

    Positions at its ends move by `short`, those farther inside less, and most not at all.
    """
    first, last = span.middle[0], span.middle[-1]
    zone = max(first - span.low, span.high - last)
    if zone == 0.0:
        return at
    run = min(RUN * zone, (last - first) / sum(span.edges))
    low, high = (np.clip(1.0 - inside / run, 0.0, 1.0) for inside in (at - first, last - at))
    return np.asarray(at + short * (span.edges[1] * high - span.edges[0] * low))


def _joined(parts: list[Part]) -> Part:
    """One part from several, with coincident points merged."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    points = np.concatenate([points for points, _ in parts])
    cells = np.concatenate([cells + start for (_, cells), start in zip(parts, starts, strict=True)])
    near = SAME_POINT * float(np.ptp(points, axis=0).max())
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")  # of a place all of them
    first = np.arange(len(points))
    np.minimum.at(first, pairs.max(axis=1), pairs.min(axis=1))
    return points, first[cells]
