"""Grid lines of the built-in block, refined at the edges of the contact and at the plate.

`numerics.refinement` divides every cell size by the same number, so meshes of different refinement
are similar.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.mesh.grid import Lines, graded
from iceslide_fem.mesh.shape import BlockShape, Channel, Slot, Wave

# The reference cell is the height (or the lateral size, if smaller) over CELLS. A block lower than
# FLAT of its length takes fewer cells, by the square root: away from its edges the strain hardly
# varies over the height. Sizes are in reference cells. With a slope of 4 cells are 1 + 4 times
# larger at a distance of one height (or lateral size) from the edge or the bottom.
CELLS = {2: 16.0, 3: 6.0}  # by dimension
# Factor by which cells are shorter along x, the sliding direction, where pressure, film and heat
# vary most. It holds for a block as long as tall. It is smaller for a longer block, whose edges are
# a smaller part of the contact. In 3-D cells are longer over the height, where they cost most and
# matter least. The errors of all directions are then similar (docs/validation/accuracy.md).
SHORTER_ALONG_X = {2: 1.2, 3: 2.25}
LONGER_ALONG_Z = {2: 1.0, 3: 4.0 / 3.0}
FLAT, FEWEST_CELLS = 0.5, 2.0
EDGE_CELL, EDGE_SLOPE = 0.42, 4.0
LARGEST_CELL = 4.0
# A cut edge may need cells smaller than EDGE_CELL. They grow by this slope, over `refinement`, up
# to the full size. In a slice with four sipes a slope of 0.6 takes half of the unknowns of 0.2 and
# four times its error; two elements on half of an arc, at 0.3, take a third more unknowns and leave
# the error. In a cube the slope of a sharp edge at EDGE_CELL takes 2.4 times the unknowns and moves
# the mean of mu 1 % away from that of a finer mesh (100 um).
STEEPEST = {2: 0.2, 3: 1.0}
# A cut edge of radius r has special cells within ZONE r of the corner that it replaces. The lowest
# LAYER r of them form a layer along the edge.
ZONE, LAYER = 2.0, 0.6
LAYER_FRACTION = 0.4  # cells across that layer over cells along half of it
# Largest size of the cells on an arc, in cells of an edge; half of it has at least `refinement`.
CELL_OF_ARC = {2: 0.75, 3: 1.0}
CELLS_OF_A_WAVE, FEWEST_OF_A_WAVE = 8.0, 4.0


class EdgeCells(NamedTuple):
    """Cells of a cut edge.

    Radius, m; number of cells on half of the arc, and on an equal length of the flat bottom beside
    it; number of cells across the layer along it.
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
        """Distances from the corner, m: lines of the layer, and lines of the rest of the zone."""
        layer, zone = LAYER * self.radius, ZONE * self.radius
        return [
            np.linspace(0.0, layer, self.layer + 1),
            np.linspace(layer, zone, self.along + 1),
        ]

    @property
    def cell(self) -> float:
        """Size of the outermost cells of the zone, m."""
        return (ZONE - LAYER) * self.radius / self.along


class Grading(NamedTuple):
    """Cell sizes along one direction.

    Reference cell, m; reference length of slopes, m; cells of a cut edge, and the slope with which
    smaller cells grow.
    """

    cell: float
    size: float
    edge: EdgeCells | None
    steepest: float

    def half(self, length: float, cut: bool) -> Lines:
        """Lines from an end, which may have a cut edge."""
        first = self.edge.cell if self.edge and cut else None
        return from_edge(length, self.cell, self.size, first, self.steepest)

    def between(self, low: float, high: float, first: bool = False, last: bool = False) -> Lines:
        """Lines between two ends; `first` and `last`: whether they have a cut edge."""
        one, other = (self.half((high - low) / 2, cut) for cut in (first, last))
        return np.concatenate([low + one, high - other[-2::-1]])

    def from_plane(self, low: float, high: float, cut: bool = False) -> Lines:
        """Lines from a plane of symmetry to an end, which may have a cut edge."""
        line = high - self.half(high - low, cut)[::-1]
        line[0] = low
        return line


class Span(NamedTuple):
    """A lug, or a slot or channel between lugs, along x or y, from `low` to `high`, m.

    middle: lines between the zones of its cut edges; edges: whether its lower and upper end have a
    cut edge; depth: of a slot or channel, 0 for a lug.
    """

    low: float
    high: float
    middle: Lines
    edges: tuple[bool, bool]
    depth: float

    @property
    def corners(self) -> list[tuple[float, int]]:
        """Corners replaced by its cut edges, with the side of the rubber: above (+1) or below
        (-1).
        """
        ends = ((self.low, 1), (self.high, -1))
        return [end for end, there in zip(ends, self.edges, strict=True) if there]

    def lines(self, zone: list[Lines]) -> list[Lines]:
        """Its lines, with those of the zones of its cut edges."""
        first = [self.low + line for line in zone] * self.edges[0]
        last = [self.high - line[::-1] for line in zone[::-1]] * self.edges[1]
        return [*first, self.middle, *last]


class Grid(NamedTuple):
    """Lines of the straight block: spans along x and (in 3-D) y, rows of z; cells of cut edges."""

    columns: list[Span]
    across: list[Span]
    rows: list[Lines]
    edge: EdgeCells | None

    @property
    def zone(self) -> list[Lines]:
        """Lines of a cut edge's zone, from its corner; none for a sharp edge."""
        return self.edge.zone if self.edge else []

    @property
    def lines(self) -> list[Lines]:
        """All lines of x, (y,) z."""
        along = [
            joined([line for span in spans for line in span.lines(self.zone)])
            for spans in (self.columns, self.across)
            if spans
        ]
        return [*along, joined(self.rows)]


def reference_cells(block: BlockShape, refinement: float) -> tuple[list[float], float]:
    """Reference cells along x, (y,) z, and the reference length of slopes, all in m."""
    dimension = len(block.ranges) + 1
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2
    lateral = min(lengths)
    cells = CELLS[dimension] * math.sqrt(min(1.0, block.height / (FLAT * lateral)))
    size = min(lateral, block.height)
    cell = size / (max(cells, FEWEST_CELLS) * refinement)
    shorter = max(SHORTER_ALONG_X[dimension] * min(1.0, size / lengths[0]), 1.0)
    return [cell / shorter, *[cell] * (dimension - 2), cell * LONGER_ALONG_Z[dimension]], size


def from_edge(
    length: float, cell: float, size: float, first: float | None = None, steepest: float = 0.0
) -> Lines:
    """Grid lines at the distances 0 ... `length` from a contact edge.

    first: size of the first cell, m, if it is not that of an edge; steepest: slope of smaller
    cells.
    """
    usual, slope = EDGE_CELL * cell, EDGE_SLOPE * EDGE_CELL * cell / size
    if first is not None and first < usual:
        slope = max(slope, steepest)
    return graded(length, first or usual, slope, LARGEST_CELL * cell)


def joined(lines: list[Lines]) -> Lines:
    """Lines concatenated, with common ends once."""
    return np.concatenate([lines[0], *(line[1:] for line in lines[1:])])


def block_grid(block: BlockShape, refinement: float) -> Grid:
    """Lines of the straight `block`."""
    cells, size = reference_cells(block, refinement)
    edge = _edge_cells(block, cells[0], refinement)
    steepest = STEEPEST[len(cells)] / refinement
    gradings = [Grading(cell, size, edge, steepest) for cell in cells]
    waves = [slot.wave for slot in block.slots if slot.wave]
    columns = _spans(block.ranges[0], block.slots, gradings[0], False)
    across = [
        span._replace(middle=_waved(span.middle, waves, True, refinement))
        for ends in block.ranges[1:]
        for span in _spans(ends, block.channels, gradings[1], block.symmetric)
    ]
    rows = [_waved(row, waves, False, refinement) for row in _rows(block, gradings[-1])]
    return Grid(columns, across, rows, edge)


def box_lines(block: BlockShape, refinement: float) -> list[Lines]:
    """Grid lines of the rubber in x, (y,) z."""
    return block_grid(block, refinement).lines


def _spans(
    ends: tuple[float, float], cuts: Sequence[Slot | Channel], sized: Grading, halved: bool
) -> list[Span]:
    """Lugs, and the cuts between them. The middle plane of a `halved` block is not an edge."""
    lows, highs = [ends[0], *(cut.high for cut in cuts)], [*(cut.low for cut in cuts), ends[1]]
    pieces = [(low, high, 0.0) for low, high in zip(lows, highs, strict=True)]
    pieces += [(cut.low, cut.high, cut.depth) for cut in cuts]
    reach = sized.edge.zone[-1][-1] if sized.edge else 0.0
    found: list[Span] = []
    for low, high, depth in sorted(pieces):
        if high <= low:  # a channel in the middle plane has no lug before it
            continue
        last = sized.edge is not None and depth == 0.0
        inside = halved and low == ends[0]
        first = last and not inside
        begin, end = low + reach * first, high - reach * last
        if inside:
            middle = sized.from_plane(begin, end, last)
        else:
            middle = sized.between(begin, end, first, last)
        found.append(Span(low, high, middle, (first, last), depth))
    return found


def _edge_cells(block: BlockShape, cell: float, refinement: float) -> EdgeCells | None:
    if block.edge == 0.0:
        return None
    dimension = len(block.ranges) + 1
    largest = CELL_OF_ARC[dimension] * EDGE_CELL * cell
    arc = max(math.ceil(refinement), math.ceil(math.pi / 4 * block.edge / largest))
    return EdgeCells(block.edge, arc, max(1, round(LAYER_FRACTION * 2 * arc)))


def _rows(block: BlockShape, sized: Grading) -> list[Lines]:
    """Rows of z: those of cut edges, then up to the end of each slot, to each layer, and to the
    plate.

    Corners at the plate and at the end of a slot are as singular as those at the ice.
    """
    depths = {slot.depth for slot in block.slots} | {cut.depth for cut in block.channels}
    ends = sorted(depths.union(block.layers))
    rows: list[Lines] = list(sized.edge.zone) if sized.edge else []
    low = float(rows[-1][-1]) if rows else 0.0
    for number, high in enumerate([*ends, block.height]):
        rows.append(sized.between(low, high, bool(sized.edge) and number == 0))
        low = high
    if block.skin and not sized.edge:
        rows[0] = _with_skin(rows[0], block.skin)
    return rows


def _with_skin(line: Lines, skin: float) -> Lines:
    """Lines with the first cell divided: the first part is `skin` (m) thick, each next one
    twice.
    """
    first = line[1] - line[0]
    count = math.ceil(math.log2(first / skin + 1.0))
    ends = np.expm1(math.log(2.0) * np.arange(count + 1)) / (2.0**count - 1.0)
    return np.concatenate([line[0] + first * ends, line[2:]])


def _waved(line: Lines, waves: list[Wave], across: bool, refinement: float) -> Lines:
    """The line with crests of waves, and with cells divided that are too long for the waves."""
    waves = [wave for wave in waves if wave.across == across]
    if not waves:
        return line
    cells = max(CELLS_OF_A_WAVE * refinement, FEWEST_OF_A_WAVE)
    longest = min(wave.length for wave in waves) / cells
    parts = [
        np.linspace(low, high, max(1, math.ceil((high - low) / longest)) + 1)
        for low, high in itertools.pairwise(line)
    ]
    line = joined(parts)
    for crest in itertools.chain(*(wave.crests(line[0], line[-1]) for wave in waves)):
        nearest = int(np.abs(line - crest).argmin())
        if 0 < nearest < len(line) - 1:
            line[nearest] = crest
    return line
