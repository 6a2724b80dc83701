"""Maps of a footprint as cell data of a file for ParaView, written by VTK.

VTK's writer reports a full disk; pyvista's does not.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLImageDataWriter

Maps = Mapping[str, NDArray[Any]]  # by name, (ny, nx)


def write_maps(path: Path, maps: Maps, pixel: tuple[float, float]) -> None:
    """Write the maps to `path` (.vti), a grid of pixels in the plane z = 0.

    pixel: size along x and y, m. Values are stored compressed and binary. VTK's default, text
    (base64), takes three times as long to write and ten times as long to read. Raises OSError.
    """
    grid = vtkImageData()
    rows, columns = next(iter(maps.values())).shape
    grid.SetDimensions(columns + 1, rows + 1, 1)
    grid.SetSpacing(*pixel, 1.0)
    for name, values in maps.items():
        array = numpy_to_vtk(values.ravel())
        array.SetName(name)
        grid.GetCellData().AddArray(array)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToLZ4()
    writer.Write()
    if code := writer.GetErrorCode():
        raise OSError(code, os.strerror(code), str(path))


def read_maps(path: Path, names: Mapping[str, str]) -> tuple[Maps, tuple[float, float]]:
    """The maps in `path` by the keys of their `names`, and the size of a pixel along x and y (m).

    Raises ValueError if one is missing.
    """
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    columns, rows, _ = (count - 1 for count in grid.GetDimensions())
    found = {key: grid.GetCellData().GetArray(name) for key, name in names.items()}
    if min(rows, columns) < 1 or None in found.values():
        raise ValueError(f"{path.name} is damaged")
    maps = {key: vtk_to_numpy(array).reshape(rows, columns) for key, array in found.items()}
    return maps, grid.GetSpacing()[:2]
