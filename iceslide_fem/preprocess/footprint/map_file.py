"""Maps of a footprint as cell data of one file that ParaView opens, by VTK itself.

VTK alone is imported in a quarter of the time that pyvista takes.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLImageDataWriter


class Maps(NamedTuple):
    """Maps by their names, arrays (ny, nx), and the size of a pixel along x and y (m)."""

    maps: Mapping[str, NDArray[Any]]
    pixel: tuple[float, float]


def write_maps(path: Path, given: Maps) -> None:
    """Write the maps to `path` (.vti), a grid of pixels in the plane z = 0.

    Values are kept as they are and compressed: as text (base64), which VTK's default is, they would
    take three times as long to write and ten times as long to read. Raises OSError.
    """
    grid = vtkImageData()
    rows, columns = next(iter(given.maps.values())).shape
    grid.SetDimensions(columns + 1, rows + 1, 1)
    grid.SetSpacing(*given.pixel, 1.0)
    for name, values in given.maps.items():
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


def read_maps(path: Path, names: Collection[str]) -> Maps:
    """The maps of these `names` in `path`. Raises ValueError if they are not there."""
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    wanted = reader.GetCellDataArraySelection()
    wanted.DisableAllArrays()
    for name in names:
        wanted.EnableArray(name)
    reader.Update()
    grid = reader.GetOutput()
    columns, rows, _ = (count - 1 for count in grid.GetDimensions())
    found = {name: grid.GetCellData().GetArray(name) for name in names}
    if min(rows, columns) < 1 or None in found.values():
        raise ValueError(f"{path.name} is damaged")
    maps = {name: vtk_to_numpy(array).reshape(rows, columns) for name, array in found.items()}
    return Maps(maps, grid.GetSpacing()[:2])
