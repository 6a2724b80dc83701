"""A mesh whose cells and facets have names, its facets, and its sizes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.runtime.arrays import Array, Mask

IntArray = NDArray[np.int64]

FACETS: dict[str, list[tuple[int, ...]]] = {  # by corners, in the order S1, S2, ... of Abaqus
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quadrilateral": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetrahedron": [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)],
    "hexahedron": [
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    ],
}


class TaggedMesh(NamedTuple):
    """A mesh, undistributed. Nodes of cells and facets are numbered as gmsh does.

    points (n, dim) in m; cell_type triangle, quadrilateral, tetrahedron or hexahedron;
    cells (m, corners); facets: name -> (k, corners of a facet); body: name of the cells; regions:
    name -> (k,) numbers of cells, if there are several; each cell is in one region.
    """

    points: Array
    cell_type: str
    cells: IntArray
    facets: Mapping[str, IntArray]
    body: str
    regions: Mapping[str, IntArray] = {}  # noqa: RUF012 - nobody writes to it

    @property
    def named_cells(self) -> Mapping[str, IntArray]:
        """Numbers (k,) of the cells by name: the regions, or all cells of the body."""
        return self.regions or {self.body: np.arange(len(self.cells))}

    @property
    def empty(self) -> TaggedMesh:
        """The same names without points, cells and facets."""
        facets = {name: nodes[:0] for name, nodes in self.facets.items()}
        regions = {name: cells[:0] for name, cells in self.regions.items()}
        return TaggedMesh(
            self.points[:0], self.cell_type, self.cells[:0], facets, self.body, regions
        )


def facets_of(tagged: TaggedMesh) -> IntArray:
    """Facets of all cells, inner ones twice: (cells * facets of a cell, corners of a facet)."""
    facets = tagged.cells[:, np.array(FACETS[tagged.cell_type])]
    return facets.reshape(-1, facets.shape[-1])


def outer_facets(tagged: TaggedMesh) -> IntArray:
    """Facets with one cell only, (n, corners)."""
    facets = facets_of(tagged)
    _, first, count = np.unique(
        np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True
    )
    return facets[np.sort(first[count == 1])]


def cells_of(tagged: TaggedMesh, facets: IntArray) -> IntArray:
    """Number of a cell that has each of the facets (n, corners), in any order of corners, (n,)."""
    every = facets_of(tagged)
    both = np.sort(np.concatenate([every, facets]), axis=1)
    _, first, number = np.unique(both, axis=0, return_index=True, return_inverse=True)
    per_cell = len(every) // len(tagged.cells)
    return np.asarray(first[number.ravel()[len(every) :]] // per_cell)


def among(facets: IntArray, others: IntArray) -> Mask:
    """Whether each of the facets (n, corners) is one of the `others`, in any order of corners."""
    both = np.sort(np.concatenate([facets, others]), axis=1)
    _, number = np.unique(both, axis=0, return_inverse=True)
    number = number.ravel()
    return np.isin(number[: len(facets)], number[len(facets) :])


def mesh_size(tagged: TaggedMesh) -> dict[str, float]:
    """Cells, nodes of the quadratic elements, smallest and largest cell edge in m."""
    facets = facets_of(tagged)
    pairs = np.concatenate([facets, np.roll(facets, 1, axis=1)]).reshape(2, -1).T
    edges = np.unique(np.sort(pairs, axis=1), axis=0)
    lengths = np.linalg.norm(np.diff(tagged.points[edges], axis=1), axis=-1)
    nodes = len(tagged.points) + len(edges)
    if tagged.cell_type in ("quadrilateral", "hexahedron"):
        nodes += len(tagged.cells)
    if tagged.cell_type == "hexahedron":
        nodes += len(np.unique(np.sort(facets, axis=1), axis=0))
    return {
        "cells": len(tagged.cells),
        "quadratic_nodes": nodes,
        "smallest_m": float(lengths.min()),
        "largest_m": float(lengths.max()),
    }


def smallest_angle(tagged: TaggedMesh) -> float:
    """Smallest angle between two edges that meet in a corner of a cell's face, degrees."""
    flat = tagged.points.shape[1] == 2
    corners = tagged.points[tagged.cells if flat else facets_of(tagged)]
    before, after = (np.roll(corners, shift, axis=1) - corners for shift in (1, -1))
    lengths = np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
    cosine = np.clip((before * after).sum(axis=2) / lengths, -1.0, 1.0)
    return float(np.degrees(np.arccos(cosine.max())))
