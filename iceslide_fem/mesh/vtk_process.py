"""Read a mesh with VTK in a process of its own: python -P vtk_process.py MESH.vtu CELLS.npz

VTK cannot live in one process with DOLFINx, and a damaged file may end it. This module imports
nothing of the package. Arrays of grid i in the file that it writes: `i points` (n, 3), `i types`,
`i offsets`, `i connectivity` as in VTK, and `i/NAME` for every cell data of one number.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np


def main(source: str, target: str) -> None:
    """Write the unstructured grids of `source` to `target`; exit with a sentence on failure."""
    grids = list(unstructured(output(source)))
    if not grids:
        sys.exit("it holds no unstructured grid of cells")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    arrays = {}
    for number, grid in enumerate(grids):
        cells, data = grid.GetCells(), grid.GetCellData()
        arrays[f"{number} points"] = vtk_to_numpy(grid.GetPoints().GetData())
        arrays[f"{number} types"] = [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())]
        arrays[f"{number} offsets"] = vtk_to_numpy(cells.GetOffsetsArray())
        arrays[f"{number} connectivity"] = vtk_to_numpy(cells.GetConnectivityArray())
        for place in range(data.GetNumberOfArrays()):
            values = data.GetArray(place)  # none for texts
            if values is not None and values.GetNumberOfComponents() == 1 and values.GetName():
                arrays[f"{number}/{values.GetName()}"] = vtk_to_numpy(values)
    np.savez(target, **arrays)


def output(source: str) -> Any:
    """What the reader of the file's suffix gives."""
    suffix = Path(source).suffix.lower()
    reader: Any
    if suffix in (".xdmf", ".xmf"):
        from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

        reader = vtkXdmfReader()
    elif suffix == ".vtu":
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

        reader = vtkXMLUnstructuredGridReader()
    else:
        from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader

        reader = vtkUnstructuredGridReader()
        reader.ReadAllScalarsOn()
        reader.ReadAllFieldsOn()
    reader.SetFileName(source)
    reader.Update()
    return reader.GetOutputDataObject(0)


def unstructured(found: Any) -> list[Any]:
    """All unstructured grids with cells in what a reader gives, in the file's order."""
    if found is None:
        return []
    if found.IsA("vtkMultiBlockDataSet"):
        blocks = [found.GetBlock(number) for number in range(found.GetNumberOfBlocks())]
        return [grid for block in blocks for grid in unstructured(block)]
    if found.IsA("vtkUnstructuredGrid") and found.GetNumberOfCells():
        return [found]
    return []


if __name__ == "__main__":
    main(*sys.argv[1:])
