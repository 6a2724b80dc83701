"""Maps of a footprint as cell data of a file for ParaView, written by VTK.

VTK's writer reports a full disk; pyvista's does not.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

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
