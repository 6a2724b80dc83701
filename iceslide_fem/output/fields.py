"""Fields as VTK time series, readable at any time while they grow."""

from __future__ import annotations

import functools
import os
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import meshio
import numpy as np
from meshio.vtu import _vtu

from iceslide_fem.files import replace_file, writing
from iceslide_fem.output.grids import Grid

# meshio has no choice of level: its own, zlib's default, takes five times as long as the first one
# for files of the same size. A mesh is the same in every file: its last 2 MB are packed once.
_RECENT = 64
_ZLIB = SimpleNamespace(
    compress=functools.lru_cache(_RECENT)(functools.partial(zlib.compress, level=1))
)


class Fields:
    """Time series `NAME.pvd` in one folder, of grids that rank 0 has.

    A file is listed when it is whole, and lists are replaced as a whole: an interrupted run leaves
    nothing half. After a loss of power the last files may be: no step waits for the disk. Values
    are written with single precision, points with double.
    """

    def __init__(
        self, folder: Path | str, rank: int, earlier: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        """`earlier`: what `written` was when the run that goes on was interrupted."""
        self._folder, self._rank = Path(folder), rank
        self.written = [dict(entry) for entry in earlier]

    def write(self, time: float, grids: Mapping[str, Grid | None]) -> None:
        """Append `grids`, by their names, at `time` (s). Raises OutputError, on rank 0."""
        number = len(self.written)
        files = {name: f"{name}_{number:06d}.vtu" for name in grids}
        self.written.append({"time": time, **files})
        if self._rank > 0:
            return
        with writing(self._folder):
            self._folder.mkdir(parents=True, exist_ok=True)
        for name, grid in grids.items():
            assert grid is not None
            _write_grid(self._folder / files[name], grid)
        for name in grids:
            self._list(name)

    def _list(self, name: str) -> None:
        entries = "".join(
            f'    <DataSet timestep="{one["time"]:.12g}" part="0" file="{one[name]}" />\n'
            for one in self.written
            if name in one
        )
        text = (
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0">\n'
            f"  <Collection>\n{entries}  </Collection>\n</VTKFile>\n"
        )
        replace_file(self._folder / f"{name}.pvd", text, durable=False)


def _write_grid(path: Path, grid: Grid) -> None:
    """Write the file beside its place, and rename it when it is whole."""
    point_data = {name: value.astype(np.float32) for name, value in grid.point_data.items()}
    cell_data = {name: [value.astype(np.float32)] for name, value in grid.cell_data.items()}
    temporary = path.with_name(path.stem + ".part.vtu")
    with writing(path), mock.patch.object(_vtu, "zlib", _ZLIB):
        try:
            meshio.write_points_cells(
                temporary, grid.points, [(grid.kind, grid.cells)], point_data, cell_data
            )
            os.replace(temporary, path)
        except OSError:
            temporary.unlink(missing_ok=True)
            raise
