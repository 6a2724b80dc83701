"""Fields as VTK time series, readable at any time while they grow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.files import replace_end, replace_file, writing
from iceslide_fem.output.grids import Grid
from iceslide_fem.output.vtu import vtu

_FIRST = b'<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0">\n  <Collection>\n'
_LAST = b"  </Collection>\n</VTKFile>\n"


class Fields:
    """Time series `NAME.pvd` in one folder, of grids each of which one rank has.

    A file is listed when it is whole, and a list grows by an entry and its end in one: an
    interrupted run leaves nothing half. After a loss of power the last files may be: no step waits
    for the disk. Values are written with single precision, points with double.
    """

    def __init__(
        self, folder: Path | str, comm: Any, earlier: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        """`earlier`: what `written` was when the run that goes on was interrupted."""
        self._folder, self._comm = Path(folder), comm
        self.written = [dict(entry) for entry in earlier]
        self._ends: dict[str, int] = {}  # of the entries in each list, bytes

    def write(self, time: float, grids: Mapping[str, Grid | None]) -> None:
        """Append `grids`, by their names, at `time` (s): None where another rank has it.

        Collective. Raises OutputError on a rank that cannot write.
        """
        number = len(self.written)
        files = {name: f"{name}_{number:06d}.vtu" for name in grids}
        self.written.append({"time": time, **files})
        with writing(self._folder):
            self._folder.mkdir(parents=True, exist_ok=True)
        for name, grid in grids.items():
            if grid is not None:
                replace_file(self._folder / files[name], vtu(grid), durable=False)
        self._comm.Barrier()
        if self._comm.rank == 0:
            for name in grids:
                self._list(name)

    def _list(self, name: str) -> None:
        """List the last file of `name`: behind the others, or all in a list of this run's own."""
        path, entry = self._folder / f"{name}.pvd", _entry(self.written[-1], name)
        if name in self._ends and path.exists():
            replace_end(path, self._ends[name], entry + _LAST)
        else:
            entry = b"".join(_entry(one, name) for one in self.written if name in one)
            replace_file(path, _FIRST + entry + _LAST, durable=False)
            self._ends[name] = len(_FIRST)
        self._ends[name] += len(entry)


def _entry(one: Mapping[str, Any], name: str) -> bytes:
    line = f'    <DataSet timestep="{one["time"]:.12g}" part="0" file="{one[name]}" />\n'
    return line.encode()
