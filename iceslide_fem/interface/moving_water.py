"""Water below a sliding block, which moves more slowly than the ice.

All functions take heights on nodes of the grid's shape, x first, and return the heights after a
step and the water that leading edges wipe off or push out, m. `drag` is the speed of the water over
the ice, over the sliding speed; ways are sliding distances of the block, in cells.

Water that only fills voids moves by whole cells, exactly (`by_cells`). Water that bears load
changes the friction wherever it comes, so it has to move in every step (`flowing`).
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.runtime.arrays import Array, Mask

WHOLE = 0.95  # contact fraction from which a cell counts as covered
HALF = 0.5  # least covered fraction of a covered node's cell


def by_cells(
    height: Array, before: Array, cover: Array, free: Array, drag: float, here: float, there: float
) -> tuple[Array, Array]:
    """Heights after the block moves from `here` to `there`.

    before, cover: contact fractions of the cells at both ends; free: H_V, m. A cell that an edge
    reaches loses the fraction `drag` of its water.
    """
    lost = np.where((cover > 0.0) & (before == 0.0), drag * height, 0.0)
    height = height - lost
    for _ in range(cells_passed(drag * here, drag * there)):
        height, pushed = moved_by_a_cell(height, cover > HALF, free)
        lost = lost + pushed
    return height, lost


def cells_passed(start: float, end: float) -> int:
    """Cells by which water moves while its characteristics go from `start` to `end` (cells)."""
    first, last = (int(np.floor(distance + 0.5 + 1e-9)) for distance in (start, end))
    return last - first


def moved_by_a_cell(height: Array, covered: Mask, free: Array) -> tuple[Array, Array]:
    """Heights (m) after water below the rubber moves by one cell in +x, and the lost water.

    Arrays have the grid's shape, x first. A covered node takes the water of the node behind it,
    also if the rubber has left that node since the last move. The foremost covered node also keeps
    its own water, up to its `free` height (m) H_V. The rest is pushed out.
    """
    behind, ahead = np.zeros_like(height), np.zeros_like(covered)
    behind[1:], ahead[:-1] = height[:-1], covered[1:]
    moved = np.where(covered, behind, 0.0) + np.where(ahead, 0.0, height)
    lost = np.where(covered & ~ahead, np.maximum(moved - np.maximum(free, behind), 0.0), 0.0)
    return moved - lost, lost


def flowing(
    height: Array, before: Array, cover: Array, free: Array, drag: float, here: float, there: float
) -> tuple[Array, Array]:
    """As `by_cells`, where voids carry: they take in all water that reaches them.

    An edge wipes off the fraction `drag` of a cell's water while it passes over the cell.
    """
    lost = drag * height * wiped(before, cover, drag)
    below = cover > HALF
    after = kept(height - lost, before > HALF, below, drag)
    return moved(after, below, drag * (there - here)), lost


def wiped(start: Array, end: Array, drag: float) -> Array:
    """Part of the water of cells that edges wipe off in a step, over the `drag`.

    start, end: contact fractions of the cells. A cell loses the fraction `drag` of its water while
    an edge passes over it.
    """
    before, after = (np.minimum(cover / WHOLE, 1.0) for cover in (start, end))
    left = np.maximum(1.0 - drag * before, 1.0 - drag * WHOLE)
    return np.maximum(after - before, 0.0) / left


def kept(height: Array, before: Mask, covered: Mask, drag: float) -> Array:
    """Heights (m) after a trailing edge has taken water along, in the grid's shape, x first.

    While it passes over a cell, the fraction `drag` of its water moves on. The first half of it has
    when the cell is no longer `covered`, as it was `before`.
    """
    after, leaves = height.copy(), before[:-1] & ~covered[:-1] & covered[1:]
    taken = np.where(leaves, 0.5 * drag / (1.0 - 0.5 * drag) * height[:-1], 0.0)
    after[:-1] -= taken
    after[1:] += taken
    return after


def moved(height: Array, covered: Mask, part: float) -> Array:
    """Heights after water moves by a `part` of a cell in +x, from covered to covered nodes.

    By an upwind flux with limited slopes (B. van Leer, J. Comput. Phys. 32 (1979) 101), which is
    exact for a whole cell.
    """
    joined = covered[:-1] & covered[1:]
    rise = np.where(joined, np.diff(height, axis=0), 0.0)
    slope, out = np.zeros_like(height), np.zeros_like(height)
    smaller = np.sign(rise[1:]) * np.minimum(np.abs(rise[:-1]), np.abs(rise[1:]))
    slope[1:-1] = np.where(rise[:-1] * rise[1:] > 0.0, smaller, 0.0)
    out[:-1] = np.where(joined, part * (height + 0.5 * (1.0 - part) * slope)[:-1], 0.0)
    after = height - out
    after[1:] += out[:-1]
    return after
