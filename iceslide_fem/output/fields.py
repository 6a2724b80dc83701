"""Fields as VTK time series, readable at any time while they grow."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import meshio
import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import OutputError
from iceslide_fem.fenics.compat import VtkSeries, cell_name, fem
from iceslide_fem.files import replace_file, writing
from iceslide_fem.rubber.contact_surface import FACET_OF, ContactSurface
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody

ZERO_CELSIUS = 273.15  # K

# By the facet's kind: meshio's name, and its corners in VTK's order (DOLFINx counts row by row).
_VTK_FACETS = {
    "interval": ("line", [0, 1]),
    "triangle": ("triangle", [0, 1, 2]),
    "quadrilateral": ("quad", [0, 1, 3, 2]),
}


class Fields:
    """Time series `rubber.pvd`, `ice.pvd` and `interface.pvd` in one folder.

    rubber: displacement (m) on the undeformed mesh; ice: temperature (degC); interface: the
    contact facets at their deformed positions with facet means as cell data. In a slice all
    points are (x, z, 0). Use as a context manager, or `close()` it; everything is collective.
    An error leaves it unclosed: what is listed is whole already.
    """

    def __init__(
        self,
        folder: Path | str,
        rubber: HyperelasticBody,
        surface: ContactSurface,
        ice_temperature: fem.Function | None = None,
        earlier: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        """`ice_temperature` (K) is a Function on the ice mesh, or None: then no `ice.pvd`.

        `earlier`: what `written` was when the run that goes on was interrupted.
        """
        self._folder, self._surface, self._rubber = Path(folder), surface, rubber
        self._comm, self.written = surface.comm, [dict(entry) for entry in earlier]
        # DOLFINx numbers the files of a series from 0: each part of a run has its own names. Its
        # lists, which it also writes when it ends in an error, have none that is read.
        self._part, self._earlier = f"-{len(earlier)}-", len(earlier)
        if self._comm.rank == 0:
            self._folder.mkdir(parents=True, exist_ok=True)
        self._comm.Barrier()
        self._volumes = {"rubber": VtkSeries(self._folder / f"rubber{self._part}.pvd", rubber.u)}
        self._kelvin = ice_temperature
        if ice_temperature is not None:
            self._celsius = fem.Function(ice_temperature.function_space, name="temperature (degC)")
            self._volumes["ice"] = VtkSeries(self._folder / f"ice{self._part}.pvd", self._celsius)
        self._facet_name, order = _VTK_FACETS[FACET_OF[cell_name(rubber.mesh)]]
        # A facet's nodes begin with its corners, in every Lagrange element.
        self._corner_nodes = surface.nodes[:, order]
        self._corner_dofs = surface.dofs[:, order]
        nodes = self._gather(self._corner_nodes)
        if nodes is not None:  # facets that share a corner share a point
            size = float(np.ptp(nodes.reshape(-1, nodes.shape[-1]), axis=0).max())
            rounded = np.round(nodes.reshape(-1, nodes.shape[-1]) / (1e-9 * size))
            _, self._first, point = np.unique(
                rounded, axis=0, return_index=True, return_inverse=True
            )
            self._cells = point.reshape(nodes.shape[:2])

    def write(self, time: float, values: Mapping[str, Array]) -> None:
        """Append the present state at `time` (s).

        values: name with unit -> values at the contact points (f, q) of this rank; NaN where a
        point has none: the facet's mean is that of its other points.
        """
        if self._kelvin is not None:
            self._celsius.x.array[:] = self._kelvin.x.array - ZERO_CELSIUS
        for volume in self._volumes.values():
            volume.write(time)
        number = len(self.written) - self._earlier
        for name in self._volumes:  # DOLFINx does not say when a disk is full
            _check_whole(self._folder / f"{name}{self._part}_p{self._comm.rank}_{number:06d}.vtu")
        series = {name: f"{name}{self._part}{number:06d}.pvtu" for name in self._volumes}
        if self._comm.rank == 0:
            for file in series.values():
                _check_whole(self._folder / file)
        interface = f"interface_{len(self.written):06d}.vtu"
        self._write_interface(interface, values)
        self.written.append({"time": time, "interface": interface, **series})
        self._comm.Barrier()  # all pieces are there before a list names them
        if self._comm.rank == 0:
            # DOLFINx writes its lists only at the end, and an interrupted run never gets there.
            for name in (*self._volumes, "interface"):
                self._list(name)

    def close(self) -> None:
        """Finish the files."""
        names = list(self._volumes)
        while self._volumes:  # DOLFINx writes its list once more when its series is forgotten
            self._volumes.popitem()[1].close()
        self._comm.Barrier()
        if self._comm.rank == 0:
            for name in names:
                (self._folder / f"{name}{self._part}.pvd").unlink(missing_ok=True)

    def _write_interface(self, file: str, values: Mapping[str, Array]) -> None:
        corners = self._gather(self._corner_nodes + self._rubber.displacements[self._corner_dofs])
        means = {name: self._gather(self._means(at)) for name, at in values.items()}
        if corners is None:
            return
        points = corners.reshape(-1, corners.shape[-1])[self._first]
        if points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(len(points))])
        with writing(self._folder / file):
            meshio.write_points_cells(
                self._folder / file,
                points,
                [(self._facet_name, self._cells)],
                cell_data={name: [mean] for name, mean in means.items()},
            )

    def _means(self, at: Array) -> Array:
        weights = np.where(np.isnan(at), 0.0, abs(self._surface.weights))
        total = weights.sum(axis=1)
        mean = (weights * np.nan_to_num(at)).sum(axis=1) / np.where(total > 0.0, total, 1.0)
        return np.where(total > 0.0, mean, np.nan)

    def _gather(self, local: Array) -> Array | None:
        """Rows of all ranks one after the other on rank 0, None on the others."""
        parts = self._comm.gather(np.ascontiguousarray(local), root=0)
        return None if parts is None else np.concatenate(parts)

    def _list(self, name: str) -> None:
        root = ET.Element("VTKFile", type="Collection", version="1.0")
        collection = ET.SubElement(root, "Collection")
        for written in self.written:
            entry = {"timestep": f"{written['time']:.12g}", "part": "0", "file": written[name]}
            ET.SubElement(collection, "DataSet", entry)
        ET.indent(root)
        text = '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
        replace_file(self._folder / f"{name}.pvd", text)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:  # or the other ranks may not be here
            self.close()


def _check_whole(path: Path) -> None:
    """Raise OutputError if the end of a VTK file is missing."""
    with writing(path):
        if b"</VTKFile>" not in path.read_bytes()[-40:]:
            raise OutputError(f"cannot write {path}: it is not whole; the disk may be full")
