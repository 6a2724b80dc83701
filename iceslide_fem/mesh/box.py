"""Grid lines of the built-in box: cells gather at the edges of the contact and at the plate.

`numerics.refinement` divides every cell size by the same number, so meshes of different refinement
are similar.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from iceslide_fem.mesh.grid import Lines, graded
from iceslide_fem.scene import Scene

# The reference cell is the height (or the lateral size, if smaller) over CELLS. A block
# whose height is less than FLAT of its length takes fewer, by the square root, because away from
# its edges the strain hardly varies over the height. Sizes are in reference cells; a slope of 4
# makes cells 1 + 4 times larger one height (or lateral size) away from the edge or the bottom.
CELLS = {2: 16.0, 3: 6.0}  # by dimension
FLAT, FEWEST_CELLS = 0.5, 2.0
EDGE_CELL, EDGE_SLOPE = 0.42, 4.0
LARGEST_CELL = 4.0


class BlockShape(NamedTuple):
    """Ranges of x and (in 3-D) y that the rubber covers, and its height, in m.

    If it is `symmetric`, y begins at 0 and the other half is left out. sipes: ranges of x of the
    slots of `sipe_depth` (m) that are cut across it from below.
    """

    ranges: list[tuple[float, float]]
    height: float
    symmetric: bool
    sipes: list[tuple[float, float]] = []  # noqa: RUF012 (never changed)
    sipe_depth: float = 0.0


def sipe_ranges(scene: Scene) -> list[tuple[float, float]]:
    """Ranges of x of the box's sipes, m: evenly spaced."""
    rubber = scene.rubber
    cuts = np.linspace(-rubber.length / 2, rubber.length / 2, rubber.sipes + 2)[1:-1]
    half = rubber.sipe_width / 2
    return [(cut - half, cut + half) for cut in cuts.tolist()]


def reference_cell(block: BlockShape, refinement: float) -> tuple[float, float]:
    """Reference cell and the length that the slopes refer to, both in m."""
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2
    lateral = min(lengths)
    cells = CELLS[len(block.ranges) + 1] * math.sqrt(min(1.0, block.height / (FLAT * lateral)))
    size = min(lateral, block.height)
    return size / (max(cells, FEWEST_CELLS) * refinement), size


def from_edge(length: float, cell: float, size: float) -> Lines:
    """Grid lines at the distances 0 ... `length` from a contact edge."""
    slope = EDGE_SLOPE * EDGE_CELL * cell / size
    return graded(length, EDGE_CELL * cell, slope, LARGEST_CELL * cell)


def box_lines(block: BlockShape, refinement: float) -> list[Lines]:
    """Grid lines of the rubber in x, (y,) z."""
    cell, size = reference_cell(block, refinement)

    def between(low: float, high: float) -> Lines:
        half = from_edge((high - low) / 2, cell, size)
        return np.concatenate([low + half, high - half[-2::-1]])

    (first, last), *rest = block.ranges
    cuts = np.array([first, *(end for sipe in block.sipes for end in sipe), last])
    x = [between(low, high) for low, high in itertools.pairwise(cuts)]
    lines = [np.concatenate([x[0], *(line[1:] for line in x[1:])])]
    for low, high in rest:
        half_model = high - from_edge(high, cell, size)[::-1]
        lines.append(half_model if block.symmetric else between(low, high))
    # The corners at the plate, and at the end of a sipe, are as singular as those at the ice.
    depth = block.sipe_depth if block.sipes else 0.0
    z = between(depth, block.height)
    return [*lines, np.concatenate([between(0.0, depth)[:-1], z]) if block.sipes else z]
