"""Read a mesh with VTK in a separate process: python -P vtk_process.py MESH.vtu CELLS.npz

VTK and DOLFINx cannot share a process, and a damaged file may crash VTK. This module imports
nothing of the package. It writes these arrays of grid i: `i points` (n, 3), `i types`, `i offsets`,
`i connectivity` as in VTK, and `i/NAME` for every scalar cell data array.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
import vtk

READERS = {
    ".xdmf": "vtkXdmfReader",
    ".xmf": "vtkXdmfReader",
    ".vtu": "vtkXMLUnstructuredGridReader",
    ".vtk": "vtkUnstructuredGridReader",
}


def main(source: str, target: str) -> None:
    """Write the unstructured grids of `source` to `target`; exit with a sentence on failure."""
    suffix = Path(source).suffix.lower()
    reader = getattr(vtk, READERS[suffix])()
    if suffix == ".vtk":
        reader.ReadAllScalarsOn()
        reader.ReadAllFieldsOn()
    reader.SetFileName(source)
    reader.Update()
    found = pyvista.wrap(reader.GetOutputDataObject(0))
    blocks = found.recursive_iterator() if isinstance(found, pyvista.MultiBlock) else [found]
    grids = [grid for grid in blocks if isinstance(grid, pyvista.UnstructuredGrid) and grid.n_cells]
    if not grids:
        sys.exit("it holds no unstructured grid of cells")
    arrays: dict[str, Any] = {}
    for number, grid in enumerate(grids):
        arrays |= {
            f"{number} points": grid.points,
            f"{number} types": grid.celltypes,
            f"{number} offsets": grid.offset,
            f"{number} connectivity": grid.cell_connectivity,
        }
        for name, values in grid.cell_data.items():
            if values.ndim == 1 and values.dtype.kind in "biuf":  # no texts
                arrays[f"{number}/{name}"] = values
    np.savez(target, **arrays)


if __name__ == "__main__":
    main(*sys.argv[1:])
