"""Squeezed-out water that does not stay on the ice: how it moves over the nodes of the window.

Below the rubber water moves at the fraction s of the sliding speed relative to it
(`film.water_speed`), so at (1 - s) v over the ice, and where there is no contact it lies on the
ice:

    dH_s/dt + d(w H_s)/dx = squeeze rate,   w = (1 - s) v below the rubber, 0 elsewhere

w is one speed for all water that moves, so its characteristics are parallel: whenever they have
passed one cell more, all of it moves by one cell. Nothing is smeared and nothing is made or lost;
water lies within half a cell of its place (first order where a front passes).

- At a trailing edge the rubber leaves a layer s H_s on the ice: the same flux, at v instead of s v.
- At a leading edge the voids take in a layer as thick as lies on the ice, which then moves at s v;
  the rest, the fraction 1 - s of what the ice brings, is scraped off and lost. So much a sipe
  drains: nothing where water stays with the ice (s = 1); with s = 0 nothing gets to it.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.runtime.arrays import Array, Mask

HALF = 0.5  # fraction of a node's cell from which on it counts as covered


def cells_passed(start: float, end: float, cell: float) -> int:
    """Cells by which water moves while its characteristics go from `start` to `end` (m)."""
    first, last = (int(np.floor(distance / cell + 0.5 + 1e-9)) for distance in (start, end))
    return last - first


def moved_by_a_cell(height: Array, covered: Mask, free: Array) -> tuple[Array, Array]:
    """Heights (m) after what is below the rubber has moved by one cell in +x, and what gets lost.

    All arrays are of the grid's shape, x first. A node that is covered takes what was on the node
    behind it, also where the rubber has left that one since the last move; the foremost covered
    node keeps its own, too, as far as its `free` height (m) H_V allows: the rest is pushed out.
    """
    behind, ahead = np.zeros_like(height), np.zeros_like(covered)
    behind[1:], ahead[:-1] = height[:-1], covered[1:]
    moved = np.where(covered, behind, 0.0) + np.where(ahead, 0.0, height)
    lost = np.where(covered & ~ahead, np.maximum(moved - np.maximum(free, behind), 0.0), 0.0)
    return moved - lost, lost
