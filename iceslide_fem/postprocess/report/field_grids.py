"""Fields of a run as grids, read with meshio and reduced to the corners of cells.

VTK is not used, because it cannot share a process with DOLFINx, whose run has just ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import CONTACT, Quantity

PLACES = 10  # decimals of coordinates (m) for equal points
CORNERS = {"triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8}
FACES: dict[str, list[tuple[int, ...]]] = {
    "tetra": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    "hexahedron": [
        (0, 3, 2, 1),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    ],
}


class Grid(NamedTuple):
    """A mesh of one kind of cells, by their corners; values at points and cells."""

    points: Array
    kind: str
    cells: NDArray[np.int64]
    at_points: dict[str, Array]
    at_cells: dict[str, Array]

    def in_contact(self, quantity: Quantity) -> Array:
        """The quantity on every facet of an interface, NaN without contact."""
        touching = self.at_cells[CONTACT.name] > 0.0
        return np.where(touching, quantity.factor * self.at_cells[quantity.name], np.nan)


def read_grid(paths: Sequence[Path]) -> Grid:
    """One grid from all parts, with cells by corners and shared points merged."""
    import meshio

    parts = [meshio.read(path) for path in paths]
    type_ = parts[0].cells[0].type
    kind = next((name for name in CORNERS if type_.startswith(name)), type_)
    tables = [part.cells[0].data.astype(np.int64)[:, : CORNERS.get(kind)] for part in parts]
    before = np.cumsum([0, *(len(part.points) for part in parts)])[:-1]
    cells = np.concatenate([table + start for table, start in zip(tables, before, strict=True)])
    points = np.concatenate([part.points for part in parts])
    if len(parts) == 1:
        kept, cells = np.unique(cells, return_inverse=True)
    else:
        _, kept, number = np.unique(
            points.round(PLACES), axis=0, return_index=True, return_inverse=True
        )
        kept, cells = np.unique(kept[number.ravel()[cells]], return_inverse=True)
    at_points = {
        name: np.concatenate([part.point_data[name] for part in parts])[kept]
        for name in parts[0].point_data
    }
    at_cells = {
        name: np.concatenate([part.cell_data[name][0] for part in parts])
        for name in parts[0].cell_data
    }
    return Grid(points[kept], kind, cells.reshape(-1, tables[0].shape[1]), at_points, at_cells)


def mirrored(points: Array, cells: Any, values: Array) -> tuple[Array, Any, Array]:
    """Both halves of a block from its half y >= 0."""
    mirror = np.ones(points.shape[1])
    mirror[1] = -1.0
    both = np.concatenate([points, points * mirror])
    return both, np.concatenate([cells, cells + len(points)]), np.tile(values, 2)


def outer_faces(grid: Grid, half: bool) -> NDArray[np.int64]:
    """Outer faces (n, k), without those in the symmetry plane."""
    every = np.concatenate([grid.cells[:, list(face)] for face in FACES[grid.kind]])
    _, first, count = np.unique(
        np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = every[first[count == 1]]
    if half:
        size = np.ptp(grid.points[:, 1])
        outer = outer[(grid.points[outer][..., 1] > 1e-6 * size).any(axis=1)]
    return outer
