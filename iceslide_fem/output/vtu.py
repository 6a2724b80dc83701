"""Grids as files of VTK's XML format, `.vtu`, by meshio."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from iceslide_fem.output.grids import Grid
from iceslide_fem.runtime.files import replacing


def write_vtu(path: Path, grid: Grid) -> None:
    """Write a grid to `path` atomically: single precision values, double precision points.

    Raises OutputError.
    """
    mesh = meshio.Mesh(
        grid.points,
        [(grid.kind, grid.cells)],
        {name: values.astype(np.float32) for name, values in grid.point_data.items()},
        {name: [values.astype(np.float32)] for name, values in grid.cell_data.items()},
    )
    with replacing(path) as temporary:
        meshio.vtu.write(temporary, mesh)
