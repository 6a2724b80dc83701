"""The window of ice that follows a sliding block, and the placement of the rubber's points on it.

Between two shifts the block moves over the window's grid by the `offset`. When the offset reaches
one cell, all nodal values shift by one cell, exactly.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.interface.film_frame import ContactLoads, Ice
from iceslide_fem.interface.surface_grid import Contacts, Placement, SurfaceGrid
from iceslide_fem.runtime.arrays import Array

# A step needs the same few contacts several times: at its ends and at the ends of its substeps.
RECENT = 8


class PassingIce(Ice, Protocol):
    """Sliding ice below the nodes of `grid`."""

    grid: SurfaceGrid

    def shifted(self, heat_state: Array, cells: int, ahead: Array) -> Array:
        """Heat state after the window moves `cells` cells in +x. Collective.

        ahead: heat state of a window of the ice that enters.
        """

    def alike(self, heat_state: Array, line: int) -> Array:
        """Heat state of ice that is everywhere along x as at a `line` of the grid. Collective."""


def on_window(contact: ContactLoads) -> Array:
    """Positions of the rubber's points in the window's coordinates, (n, d-1), m."""
    positions = contact.positions.copy()
    positions[:, 0] += contact.offset
    return positions


@lru_cache(maxsize=RECENT)
def place(grid: SurfaceGrid, contact: ContactLoads) -> Placement:
    """Placement of the rubber's points on the window's grid. Recent results are cached."""
    return grid.place(on_window(contact))


def passed_over(grid: SurfaceGrid, start: ContactLoads, end: ContactLoads) -> Contacts:
    """Placement of the points in the middle of a step, and their mean contact area."""
    middle = replace(
        end,
        positions=0.5 * (start.positions + end.positions),
        offset=0.5 * (start.offset + end.offset),
    )
    return Contacts(place(grid, middle), 0.5 * (start.touching + end.touching))


def reaches(grid: SurfaceGrid, contact: ContactLoads) -> bool:
    """Whether all touching points are within the window."""
    positions = on_window(contact)[contact.pressure > 0.0]
    low, high = np.array([(line[0], line[-1]) for line in grid.lines]).T
    return bool(((low <= positions) & (positions <= high)).all())


def whole_cells(grid: SurfaceGrid, offset: float) -> tuple[int, float]:
    """Number of whole cells in `offset` (m), and the remainder (m)."""
    line = grid.lines[0]
    cell = float(line[1] - line[0])
    cells = int(np.floor(offset / cell + 1e-9))
    return cells, offset - cells * cell


def shifted(grid: SurfaceGrid, own: Array, cells: int, ahead: ArrayLike) -> Array:
    """Values (..., own) of this rank's nodes after a shift by `cells`. Collective.

    ahead: values of a window of the ice that enters, which broadcast to (..., own).
    """
    nodes = grid.allgather(own)
    behind = grid.own + cells * (grid.n_nodes // grid.shape[0])  # nodes are numbered along x last
    moved = nodes[..., np.minimum(behind, grid.n_nodes - 1)]
    return np.where(behind < grid.n_nodes, moved, ahead)


def alike(grid: SurfaceGrid, own: Array, line: int) -> Array:
    """Values (..., own) of this rank's nodes, everywhere along x as at a `line`. Collective."""
    across = grid.n_nodes // grid.shape[0]
    return np.asarray(grid.allgather(own)[..., line * across + grid.own % across])


def covered_lines(grid: SurfaceGrid, contact: ContactLoads) -> tuple[int, int]:
    """First and last line of nodes, along x, of which the rubber touches cells. Collective."""
    touched = grid.scatter(contact.touching, place(grid, contact)).reshape(grid.shape[0], -1)
    covered = np.flatnonzero(touched.any(axis=1))
    return int(covered[0]), int(covered[-1])
