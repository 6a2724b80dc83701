"""A mesh whose cells and facets have names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]


class TaggedMesh(NamedTuple):
    """A mesh, undistributed. Nodes of cells and facets are numbered as gmsh does.

    points (n, dim) in m; cell_type triangle, quadrilateral, tetrahedron or hexahedron;
    cells (m, corners); facets: name -> (k, corners of a facet); body: name of the cells. Where they
    are of several kinds, regions: name -> (k,) numbers of cells, each in one of them.
    """

    points: NDArray[np.float64]
    cell_type: str
    cells: IntArray
    facets: Mapping[str, IntArray]
    body: str
    regions: Mapping[str, IntArray] = {}  # noqa: RUF012 - nobody writes to it

    @property
    def named_cells(self) -> Mapping[str, IntArray]:
        """Numbers (k,) of the cells by their names: the regions, or all of the one body."""
        return self.regions or {self.body: np.arange(len(self.cells))}

    @property
    def empty(self) -> TaggedMesh:
        """The same names without points, cells and facets."""
        facets = {name: nodes[:0] for name, nodes in self.facets.items()}
        regions = {name: cells[:0] for name, cells in self.regions.items()}
        return self._replace(
            points=self.points[:0], cells=self.cells[:0], facets=facets, regions=regions
        )
