"""Fields as VTK time series, readable while a run writes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from iceslide_fem.output.grids import Grid
from iceslide_fem.runtime.files import replace_end, replace_file, replacing, writing


def write_vtu(path: Path, grid: Grid) -> None:
    """Write a grid to `path` atomically: single precision values, double precision points.

    Not compressed: half of the space would take a tenth of a run. Raises OutputError.
    """
    mesh = meshio.Mesh(
        grid.points,
        [(grid.kind, grid.cells)],
        {name: values.astype(np.float32) for name, values in grid.point_data.items()},
        {name: [values.astype(np.float32)] for name, values in grid.cell_data.items()},
    )
    with replacing(path) as temporary:
        meshio.vtu.write(temporary, mesh, compression=None)


_FIRST = b'<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0">\n  <Collection>\n'
_LAST = b"  </Collection>\n</VTKFile>\n"


class Fields:
    """Time series `NAME.pvd` in one folder, of grids distributed over the ranks.

    A complete file is added to the list in one write, so an interrupted run leaves valid lists.
    After a loss of power the last files may be incomplete, because no step waits for the disk.
    Values have single precision, points double precision.
    """

    def __init__(
        self, folder: Path | str, comm: Any, earlier: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        """`earlier`: `written` of the run to continue."""
        self._folder, self._comm = Path(folder), comm
        self.written = [dict(entry) for entry in earlier]
        self._ends: dict[str, int] = {}  # end of the entries in each list, bytes

    def write(self, time: float, grids: Mapping[str, Grid | None]) -> None:
        """Append this rank's parts of `grids`, by name, at `time` (s); None without a part.

        Each part is a separate file. Collective. Raises OutputError on a rank that cannot write.
        """
        number, comm, files = len(self.written), self._comm, {}
        there = comm.allgather([grid is not None for grid in grids.values()])
        parts = {
            name: {int(rank): part for part, rank in enumerate(np.flatnonzero(ranks))}
            for name, ranks in zip(grids, np.transpose(there), strict=True)
        }
        for name, numbers in parts.items():
            for part in numbers.values():
                suffix = f"_{part}" if part else ""
                files[_part(name, part)] = f"{name}_{number:06d}{suffix}.vtu"
        self.written.append({"time": time, **files})
        with writing(self._folder):
            self._folder.mkdir(parents=True, exist_ok=True)
        for name, grid in grids.items():
            if grid is not None:
                write_vtu(self._folder / files[_part(name, parts[name][comm.rank])], grid)
        comm.Barrier()
        if comm.rank == 0:
            for name in grids:
                if name in files:
                    self._list(name)

    def _list(self, name: str) -> None:
        """Append the last file of `name` to its list, or write a new list."""
        path, entry = self._folder / f"{name}.pvd", _entry(self.written[-1], name)
        if name in self._ends and path.exists():
            replace_end(path, self._ends[name], entry + _LAST)
        else:
            entry = b"".join(_entry(one, name) for one in self.written if name in one)
            replace_file(path, _FIRST + entry + _LAST)
            self._ends[name] = len(_FIRST)
        self._ends[name] += len(entry)


def _entry(one: Mapping[str, Any], name: str) -> bytes:
    """Lines of the list for all parts of `name` at one time."""
    files = [one[name]]
    while (part := _part(name, len(files))) in one:
        files.append(one[part])
    lines = (
        f'    <DataSet timestep="{one["time"]:.12g}" part="{part}" file="{file}" />\n'
        for part, file in enumerate(files)
    )
    return "".join(lines).encode()


def _part(name: str, part: int) -> str:
    """Key of a part of a grid in `Fields.written`."""
    return f"{name}.{part}" if part else name
