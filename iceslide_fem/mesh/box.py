"""Grid lines of the built-in block: cells gather at the edges of the contact and at the plate.

`numerics.refinement` divides every cell size by the same number, so meshes of different refinement
are similar.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.mesh.grid import Lines, graded
from iceslide_fem.mesh.shape import BlockShape, Wave

# The reference cell is the height (or the lateral size, if smaller) over CELLS. A block
# whose height is less than FLAT of its length takes fewer, by the square root, because away from
# its edges the strain hardly varies over the height. Sizes are in reference cells; a slope of 4
# makes cells 1 + 4 times larger one height (or lateral size) away from the edge or the bottom.
CELLS = {2: 16.0, 3: 6.0}  # by dimension
FLAT, FEWEST_CELLS = 0.5, 2.0
EDGE_CELL, EDGE_SLOPE = 0.42, 4.0
LARGEST_CELL = 4.0
# Where a cut edge asks for smaller cells than EDGE_CELL, they grow to it by this slope.
STEEPEST = 0.3
# A cut edge of radius r has its own cells within ZONE r of the corner that it replaces, of which
# the lowest LAYER r are a layer along it.
ZONE, LAYER = 2.0, 0.6
LAYER_SHARE = 0.4  # cells across that layer, of those along half of it
FEWEST_OF_ARC = 2  # cells on half of an arc: with one, mu of a slice is 2 % off (50 um)
CELLS_OF_A_WAVE = 8


class EdgeCells(NamedTuple):
    """Cells of a cut edge: radius (m); cells on half of its arc, and on as much of the flat bottom
    beside it; cells across the layer along it.
    """

    radius: float
    arc: int
    layer: int

    @property
    def along(self) -> int:
        """Cells from the middle of the arc to the end of the zone."""
        return 2 * self.arc

    @property
    def zone(self) -> list[Lines]:
        """Distances from the corner: of the layer, and of the rest of the zone, m."""
        layer, zone = LAYER * self.radius, ZONE * self.radius
        return [
            np.linspace(0.0, layer, self.layer + 1),
            np.linspace(layer, zone, self.along + 1),
        ]

    @property
    def cell(self) -> float:
        """Size of the outermost cells of the zone, m."""
        return (ZONE - LAYER) * self.radius / self.along


class Grid(NamedTuple):
    """Lines of the straight block: columns of x, rows of z, (in 3-D) all lines of y.

    slot: which slot a column belongs to, or -1; zones: per cut edge x of the corner, and whether
    the rubber is beyond (+1) or before it (-1).
    """

    columns: list[Lines]
    slot: list[int]
    rows: list[Lines]
    y: Lines | None
    edge: EdgeCells | None
    zones: list[tuple[float, int]]

    @property
    def x(self) -> Lines:
        """All lines of x."""
        return joined(self.columns)

    @property
    def z(self) -> Lines:
        """All lines of z."""
        return joined(self.rows)


def reference_cell(block: BlockShape, refinement: float) -> tuple[float, float]:
    """Reference cell and the length that the slopes refer to, both in m."""
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2
    lateral = min(lengths)
    cells = CELLS[len(block.ranges) + 1] * math.sqrt(min(1.0, block.height / (FLAT * lateral)))
    size = min(lateral, block.height)
    return size / (max(cells, FEWEST_CELLS) * refinement), size


def from_edge(length: float, cell: float, size: float, first: float | None = None) -> Lines:
    """Grid lines at the distances 0 ... `length` from a contact edge, or from cells of size
    `first` (m) near it.
    """
    usual, slope = EDGE_CELL * cell, EDGE_SLOPE * EDGE_CELL * cell / size
    if first is None:
        return graded(length, usual, slope, LARGEST_CELL * cell)
    return graded(
        length, first, max(slope, STEEPEST) if first < usual else slope, LARGEST_CELL * cell
    )


def joined(lines: list[Lines]) -> Lines:
    """Lines one after the other, common ends once."""
    return np.concatenate([lines[0], *(line[1:] for line in lines[1:])])


def block_grid(block: BlockShape, refinement: float) -> Grid:
    """Lines of the straight `block`."""
    cell, size = reference_cell(block, refinement)
    edge = _edge_cells(block, cell)

    def between(low: float, high: float, first: bool = False, last: bool = False) -> Lines:
        """Graded to both ends, of which the `first` and the `last` may meet a cut edge's cells."""
        ends = [edge.cell if edge and cut else None for cut in (first, last)]
        one, other = (from_edge((high - low) / 2, cell, size, end) for end in ends)
        return np.concatenate([low + one, high - other[-2::-1]])

    (low, high), *across = block.ranges
    columns: list[Lines] = []
    slots: list[int] = []
    zones: list[tuple[float, int]] = []
    begin = low
    for number in range(len(block.slots) + 1):
        end = block.slots[number].low if number < len(block.slots) else high
        if edge:
            layer, rest = edge.zone
            middle = between(begin + rest[-1], end - rest[-1], True, True)
            lug = [begin + layer, begin + rest, middle, end - rest[::-1], end - layer[::-1]]
            zones += [(begin, 1), (end, -1)]
        else:
            lug = [between(begin, end)]
        columns += lug
        slots += [-1] * len(lug)
        if number < len(block.slots):
            begin = block.slots[number].high
            columns.append(between(end, begin))
            slots.append(number)
    return Grid(
        columns, slots, _rows(block, edge, between), _y_lines(block, cell, size), edge, zones
    )


def box_lines(block: BlockShape, refinement: float) -> list[Lines]:
    """Grid lines of the rubber in x, (y,) z."""
    grid = block_grid(block, refinement)
    return [grid.x, grid.z] if grid.y is None else [grid.x, grid.y, grid.z]


def _edge_cells(block: BlockShape, cell: float) -> EdgeCells | None:
    if block.edge == 0.0:
        return None
    arc = max(FEWEST_OF_ARC, math.ceil(math.pi / 4 * block.edge / (EDGE_CELL * cell)))
    return EdgeCells(block.edge, arc, max(1, round(LAYER_SHARE * 2 * arc)))


def _rows(block: BlockShape, edge: EdgeCells | None, between: Callable[..., Lines]) -> list[Lines]:
    """Rows of z: those of cut edges, then up to the end of each slot, and to the plate.

    The corners at the plate, and at the end of a slot, are as singular as those at the ice.
    """
    depths = sorted({slot.depth for slot in block.slots} | {cut.depth for cut in block.channels})
    rows: list[Lines] = list(edge.zone) if edge else []
    low = float(rows[-1][-1]) if rows else 0.0
    for number, high in enumerate([*depths, block.height]):
        rows.append(between(low, high, bool(edge) and number == 0))
        low = high
    waves = [slot.wave for slot in block.slots if slot.wave and not slot.wave.across]
    return [_waved(row, waves) for row in rows]


def _y_lines(block: BlockShape, cell: float, size: float) -> Lines | None:
    if len(block.ranges) == 1:
        return None
    low, high = block.ranges[1]

    def between(low: float, high: float) -> Lines:
        half = from_edge((high - low) / 2, cell, size)
        return np.concatenate([low + half, high - half[-2::-1]])

    cuts = [low, *(end for channel in block.channels for end in channel[:2] if end > low), high]
    pieces = [between(one, other) for one, other in itertools.pairwise(cuts)]
    if block.symmetric:  # nothing is singular at the middle plane
        pieces[0] = cuts[1] - from_edge(cuts[1] - low, cell, size)[::-1]
        pieces[0][0] = low
    waves = [slot.wave for slot in block.slots if slot.wave and slot.wave.across]
    return joined([_waved(piece, waves) for piece in pieces])


def _waved(line: Lines, waves: list[Wave]) -> Lines:
    """The line's cells cut into equal parts where they are too long for a wave."""
    if not waves:
        return line
    longest = min(wave.length for wave in waves) / CELLS_OF_A_WAVE
    parts = [
        np.linspace(low, high, max(1, math.ceil((high - low) / longest)) + 1)
        for low, high in itertools.pairwise(line)
    ]
    return joined(parts)
