"""Cells that stand upright: the last axis of each is the one that leads down most steeply."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.tagged import IntArray, TaggedMesh

# Corners of a cell as gmsh numbers them, in the order of its axes: the last index counts fastest.
_CORNERS = {
    "quadrilateral": np.array([0, 3, 1, 2]).reshape(2, 2),
    "hexahedron": np.array([0, 4, 3, 7, 1, 5, 2, 6]).reshape(2, 2, 2),
}


def upright(tagged: TaggedMesh) -> TaggedMesh:
    """The same mesh of quadrilaterals or hexahedra, whose cells are turned until they stand."""
    corners = _CORNERS[tagged.cell_type]
    dim = corners.ndim
    steep = np.stack([_steepness(tagged, axis) for axis in range(dim)])
    vertical = steep.argmax(axis=0)
    cells = tagged.cells.copy()
    for axis in range(dim - 1):
        some = vertical == axis
        turned = np.transpose(corners, np.roll(np.arange(dim), dim - 1 - axis))
        cells[np.ix_(some, corners.ravel())] = tagged.cells[some][:, turned.ravel()]
    return tagged._replace(cells=cells)


def upright_edges(tagged: TaggedMesh) -> IntArray:
    """Nodes (n, 2) of the edges that lead down, in a mesh whose cells stand `upright`."""
    order = _CORNERS[tagged.cell_type]
    ends = (tagged.cells[:, np.take(order, end, order.ndim - 1).ravel()] for end in (0, 1))
    edges = np.stack(list(ends), axis=-1).reshape(-1, 2)
    return np.unique(np.sort(edges, axis=1), axis=0)


def _steepness(tagged: TaggedMesh, axis: int) -> NDArray[np.float64]:
    """Share of the vertical in the direction of each cell's `axis`, 0 to 1."""
    low, high = (
        tagged.points[tagged.cells[:, np.take(_CORNERS[tagged.cell_type], end, axis).ravel()]]
        for end in (0, 1)
    )
    along = (high - low).mean(axis=1)
    return np.asarray(np.abs(along[:, -1]) / np.linalg.norm(along, axis=1))
