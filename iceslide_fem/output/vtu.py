"""Grids as files of VTK's XML format for unstructured grids (VTU): binary, compressed by zlib.

VTK File Formats, docs.vtk.org/en/latest/vtk_file_formats: every array is base64 of a header,
(blocks, their size, the last one's, compressed sizes), and base64 of the compressed blocks; here
each is one block. meshio's writer compresses with zlib's default level: floating point numbers take
more than twice its fastest level's time, and become less than 2 % smaller.
"""

from __future__ import annotations

import base64
import sys
import zlib
from functools import lru_cache
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.output.grids import Grid

FASTEST = 1  # of zlib's levels
# VTK's numbers of meshio's kinds of cells, whose nodes are in the same order but for the wedge.
KINDS = {
    "vertex": 1,
    "line": 3,
    "triangle": 5,
    "quad": 9,
    "tetra": 10,
    "hexahedron": 12,
    "wedge": 13,
    "triangle6": 22,
    "tetra10": 24,
    "quad9": 28,
    "hexahedron27": 29,
}
_WEDGE = [0, 2, 1, 3, 5, 4]
_TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "u1": "UInt8"}


def vtu(grid: Grid) -> str:
    """The file of a grid: values with single precision, points with double."""
    cells = grid.cells[:, _WEDGE] if grid.kind == "wedge" else grid.cells
    n, corners = cells.shape
    topology = {
        "connectivity": cells.astype(np.int32),
        "offsets": corners * np.arange(1, n + 1, dtype=np.int32),
        "types": np.full(n, KINDS[grid.kind], dtype=np.uint8),
    }
    parts = {
        "Points": [_array("Points", grid.points, _kept)],
        "Cells": [_array(name, values.ravel(), _kept) for name, values in topology.items()],
        "PointData": _values(grid.point_data),
        "CellData": _values(grid.cell_data),
    }
    order = f"{sys.byteorder.capitalize()}Endian"
    lines = [
        '<?xml version="1.0"?>',
        f'<VTKFile type="UnstructuredGrid" version="0.1" byte_order="{order}" '
        'compressor="vtkZLibDataCompressor">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{n}">',
    ]
    for part, arrays in parts.items():
        lines += [f"<{part}>", *arrays, f"</{part}>"]
    return "\n".join([*lines, "</Piece>", "</UnstructuredGrid>", "</VTKFile>", ""])


def _values(data: dict[str, NDArray[Any]]) -> list[str]:
    return [_array(name, values.astype(np.float32), _packed) for name, values in data.items()]


def _array(name: str, values: NDArray[Any], packed: Any) -> str:
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    kind = _TYPES[values.dtype.str[1:]]
    start = f'<DataArray type="{kind}" Name={quoteattr(name)}{components} format="binary">'
    return f"{start}\n{packed(values.tobytes())}\n</DataArray>"


def _packed(content: bytes) -> str:
    block = zlib.compress(content, FASTEST)
    header = [1, len(content), len(content), len(block)] if content else [0, 0, 0]
    start = base64.b64encode(np.array(header, dtype=np.uint32).tobytes())
    return (start + base64.b64encode(block if content else b"")).decode()


# Meshes are the same at every time: what they are was packed for the last one.
_kept = lru_cache(maxsize=32)(_packed)
