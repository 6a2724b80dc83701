"""Motion of squeezed-out water over the nodes of the window.

Below the rubber water moves at the fraction s of the sliding speed relative to it
(`film.water_speed`), so at (1 - s) v over the ice, and where there is no contact it lies on the
ice:

    dH_s/dt + d(w H_s)/dx = squeeze rate,   w = (1 - s) v below the rubber, 0 elsewhere

w is uniform below the rubber, so the characteristics are parallel. Each time they pass one more
cell, all water below the rubber moves by one cell. This is conservative and free of numerical
diffusion. The position error is at most half a cell (first order at a front).

- At a trailing edge the rubber leaves a layer s H_s on the ice: the same flux, at v instead of s v.
- At a leading edge the voids take in a layer as thick as that on the ice, which then moves at s v.
  The fraction 1 - s of the incoming water is wiped off and lost. A sipe drains this part: none if
  water stays with the ice (s = 1). With s = 0 no water reaches a sipe.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.runtime.arrays import Array, Mask

HALF = 0.5  # least covered fraction of a covered node's cell


def cells_passed(start: float, end: float, cell: float) -> int:
    """Cells by which water moves while its characteristics go from `start` to `end` (m)."""
    first, last = (int(np.floor(distance / cell + 0.5 + 1e-9)) for distance in (start, end))
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
