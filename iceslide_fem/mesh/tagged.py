"""A mesh of one body whose cells and facets have names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]


class TaggedMesh(NamedTuple):
    """A mesh of one body, undistributed. Nodes of cells and facets are numbered as gmsh does.

    points (n, dim) in m; cell_type triangle, quadrilateral, tetrahedron or hexahedron;
    cells (m, corners); facets: name -> (k, corners of a facet); body: name of the cells.
    """

    points: NDArray[np.float64]
    cell_type: str
    cells: IntArray
    facets: Mapping[str, IntArray]
    body: str
