"""Patches of the straight block's sections: of its profile, and at its cut edges."""

from __future__ import annotations

from iceslide_fem.mesh.box import EdgeCells, Grid
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.patches import Patch, Point, even, rectangle
from iceslide_fem.mesh.shape import BlockShape

NEAR = 1e-9  # of the height
# The patches at an arc meet at this distance from its middle, and so many radii from the corner
# lies the middle of an arc, and of a cut at 45 degrees.
MEETING = 0.5
MIDDLE = {False: 1.0 - 0.5**0.5, True: 0.5}


def profile_patches(block: BlockShape, grid: Grid) -> list[Patch]:
    """Patches of the profile, which are those of the block across the sliding direction, too."""
    patches: list[Patch] = []
    for span in grid.columns:
        patches += upright(span.middle, rows_above(grid, span.depth))
        for corner, way in span.corners:
            patches += edge_patches(corner, way, grid, block.cut)
    return patches


def upright(line: Lines, rows: list[Lines]) -> list[Patch]:
    """Rectangles one above the other."""
    return [rectangle(line, row) for row in rows]


def rows_above(grid: Grid, depth: float) -> list[Lines]:
    """The rows of z above the end of a cut of this depth, m."""
    return [row for row in grid.rows if row[-1] > depth * (1.0 + NEAR)]


def edge_patches(corner: float, way: int, grid: Grid, cut: bool) -> list[Patch]:
    """Patches within the zone of a cut edge, up to the plate."""
    assert grid.edge is not None
    rows = grid.rows[len(grid.zone) :]
    columns = [corner + way * line for line in grid.zone]
    above = [patch for line in columns for patch in upright(line[::way], rows)]
    return [*_lowest_patches(corner, way, grid.edge, cut), *above]


def _lowest_patches(x: float, way: int, edge: EdgeCells, cut: bool) -> list[Patch]:
    """The three patches at a cut edge, whose sharp corner would be at (x, 0).

    The cut is one side with the bottom beside it and the wall above it: half of them belong to
    either patch along it; a third patch fills the zone's inner corner. All three meet at a point.
    """
    r, (layer, zone) = edge.radius, (lines[-1] for lines in edge.zone)

    def at(along: float, up: float) -> Point:
        return float(x + way * along), float(up)

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
