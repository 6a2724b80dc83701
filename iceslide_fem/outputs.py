"""What a run writes: histories as CSV, a summary as JSON, fields as VTK time series.

Whatever has been written stays readable when the run is interrupted.
"""

from __future__ import annotations

import csv
import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

import meshio
import numpy as np

from iceslide_fem._dolfinx import VtkSeries, cell_name, fem
from iceslide_fem.files import replace_file
from iceslide_fem.materials import Array
from iceslide_fem.rubber import Rubber
from iceslide_fem.surface import FACET_OF, ContactSurface

ZERO_CELSIUS = 273.15  # K

HISTORY_COLUMNS = (
    "time_s",
    "step_s",
    "slip_m",
    "mu",
    "film_height_m",
    "squeezed_height_m",
    "surface_temperature_C",
    "contact_fraction",
    "normal_force_N",
    "friction_force_N",
    "plate_displacement_m",
    "melted_fraction",
    "saturated_fraction",
    "friction_work_J",
    "load_work_J",
    "ice_heat_J",
    "rubber_heat_J",
    "latent_heat_J",
    "elastic_energy_J",
    "kinetic_energy_J",
    "energy_imbalance",
    "newton_iterations",
)

PRELOAD_COLUMNS = (
    "phase",  # press | ramp
    "load_fraction",
    "speed_fraction",
    "normal_force_N",
    "friction_force_N",
    "plate_displacement_m",
    "contact_fraction",
    "largest_pressure_Pa",
    "newton_iterations",
)

# By the facet's kind: meshio's name, and its corners in VTK's order (DOLFINx counts row by row).
_VTK_FACETS = {
    "interval": ("line", [0, 1]),
    "triangle": ("triangle", [0, 1, 2]),
    "quadrilateral": ("quad", [0, 1, 3, 2]),
}


class Table:
    """CSV file that grows by a row at a time and is complete after each; on rank 0 only.

    Use as a context manager. On other ranks nothing is opened or written.
    """

    def __init__(self, path: Path | str, columns: Sequence[str], rank: int) -> None:
        """Create (overwrite) the file at `path` and write its header. Raises OSError."""
        self._columns = tuple(columns)
        self._file: TextIO | None = None
        if rank == 0:
            self._file = open(path, "w", newline="", encoding="utf-8")
            self._write(self._columns)

    def row(self, values: Mapping[str, Any]) -> None:
        """Append one row; `values` has every column, and may have more. Raises KeyError."""
        if self._file is not None:
            self._write([_text(values[name]) for name in self._columns])

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def _write(self, cells: Sequence[str]) -> None:
        assert self._file is not None
        csv.writer(self._file, lineterminator="\n").writerow(cells)
        self._file.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


class Fields:
    """Time series `rubber.pvd`, `ice.pvd` and `interface.pvd` in one folder.

    rubber: displacement (m) on the undeformed mesh; ice: temperature (degC); interface: the
    contact facets at their deformed positions with facet means as cell data. In a slice all
    points are (x, z, 0). Use as a context manager, or `close()` it; everything is collective.
    """

    def __init__(
        self,
        folder: Path | str,
        rubber: Rubber,
        surface: ContactSurface,
        ice_temperature: fem.Function | None = None,
    ) -> None:
        """`ice_temperature` (K) is a Function on the ice mesh, or None: then no `ice.pvd`."""
        self._folder, self._surface, self._rubber = Path(folder), surface, rubber
        self._comm, self._times = surface.comm, list[float]()
        if self._comm.rank == 0:
            self._folder.mkdir(parents=True, exist_ok=True)
        self._comm.Barrier()
        self._volumes = {"rubber": VtkSeries(self._folder / "rubber.pvd", rubber.u)}
        self._kelvin = ice_temperature
        if ice_temperature is not None:
            self._celsius = fem.Function(ice_temperature.function_space, name="temperature (degC)")
            self._volumes["ice"] = VtkSeries(self._folder / "ice.pvd", self._celsius)
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
        self._write_interface(values)
        self._times.append(time)
        self._comm.Barrier()  # all pieces are there before a list names them
        if self._comm.rank == 0:
            # DOLFINx writes its lists only at the end, and an interrupted run never gets there.
            for name in self._volumes:
                self._list(name, f"{name}{{:06d}}.pvtu")
            self._list("interface", "interface_{:06d}.vtu")

    def close(self) -> None:
        """Finish the files."""
        for volume in self._volumes.values():
            volume.close()

    def _write_interface(self, values: Mapping[str, Array]) -> None:
        corners = self._gather(self._corner_nodes + self._rubber.displacements[self._corner_dofs])
        means = {name: self._gather(self._means(at)) for name, at in values.items()}
        if corners is None:
            return
        points = corners.reshape(-1, corners.shape[-1])[self._first]
        if points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(len(points))])
        meshio.write_points_cells(
            self._folder / f"interface_{len(self._times):06d}.vtu",
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

    def _list(self, name: str, file: str) -> None:
        root = ET.Element("VTKFile", type="Collection", version="1.0")
        collection = ET.SubElement(root, "Collection")
        for number, time in enumerate(self._times):
            entry = {"timestep": f"{time:.12g}", "part": "0", "file": file.format(number)}
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
        self.close()


def write_summary(path: Path | str, summary: Mapping[str, Any]) -> None:
    """Write `summary` as JSON; NaN and infinity become null. Call it on one rank."""
    replace_file(Path(path), json.dumps(_plain(summary), indent=2, ensure_ascii=False) + "\n")


def _text(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float | np.floating) else str(value)


def _plain(value: Any) -> Any:
    """`value` as JSON can hold it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int) else str(value)
