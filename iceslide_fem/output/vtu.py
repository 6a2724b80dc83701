"""Grids as files of VTK's XML format, `.vtu`: values in base64, compressed."""

from __future__ import annotations

import functools
import sys
import zlib
from base64 import b64encode
from collections.abc import Callable, Mapping
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from iceslide_fem.output.grids import Grid
from iceslide_fem.runtime.arrays import Array

# VTK's numbers of the kinds of cells, by meshio's names.
_KINDS = {
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
_WEDGE = [0, 2, 1, 3, 5, 4]  # of meshio's nodes those of VTK's wedge
_TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64"}
_BLOCK = 32768  # bytes that are packed together


def _packed(content: bytes) -> bytes:
    """zlib's stream of it. Digits of numbers do not repeat, but for runs of zeros: looking for more
    takes twice the time for files 1 to 5 % smaller.
    """
    packer = zlib.compressobj(level=1, strategy=zlib.Z_RLE)
    return packer.compress(content) + packer.flush()


# A mesh is the same in every file, and its numbers do repeat: of points and cells the last 2 MB are
# packed once.
_packed_once = functools.lru_cache(64)(functools.partial(zlib.compress, level=1))


def vtu(grid: Grid) -> str:
    """The file of a grid: values with single precision, points with double."""
    cells = grid.cells[:, _WEDGE] if grid.kind == "wedge" else grid.cells
    of_cells = {
        "connectivity": cells.ravel(),
        "offsets": cells.shape[1] * np.arange(1, len(cells) + 1),
        "types": np.full(len(cells), _KINDS[grid.kind]),
    }
    return "".join(
        (
            '<?xml version="1.0"?>\n',
            '<VTKFile type="UnstructuredGrid" version="0.1" compressor="vtkZLibDataCompressor"',
            f' byte_order="{sys.byteorder.capitalize()}Endian">\n<UnstructuredGrid>\n',
            f'<Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{len(cells)}">\n',
            _arrays("Points", {"Points": grid.points}, _packed_once),
            _arrays("Cells", of_cells, _packed_once),
            _arrays("PointData", _single(grid.point_data)),
            _arrays("CellData", _single(grid.cell_data)),
            "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        )
    )


def _single(data: Mapping[str, Array]) -> dict[str, Any]:
    return {name: values.astype(np.float32) for name, values in data.items()}


def _arrays(part: str, data: Mapping[str, Any], pack: Callable[[bytes], bytes] = _packed) -> str:
    """A `part` of the file with its arrays, (n,) or (n, k), by their names; nothing without any."""
    inner = "".join(_array(name, values, pack) for name, values in data.items())
    return f"<{part}>\n{inner}</{part}>\n" if inner else ""


def _array(name: str, values: Any, pack: Callable[[bytes], bytes]) -> str:
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    kind = _TYPES[values.dtype.str[1:]]
    content = values.tobytes()
    blocks = [content[at : at + _BLOCK] for at in range(0, len(content), _BLOCK)]
    packed = [pack(block) for block in blocks]
    last = len(blocks[-1]) if blocks else 0
    header = np.array([len(blocks), _BLOCK, last, *map(len, packed)], dtype=np.uint32)
    words = b64encode(header.tobytes()).decode() + b64encode(b"".join(packed)).decode()
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)}{components} format="binary">\n'
        f"{words}\n</DataArray>\n"
    )
