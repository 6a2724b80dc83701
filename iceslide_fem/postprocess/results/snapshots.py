"""Fields of a finished run at one time, read with pyvista and completed for pictures.

It does not import DOLFINx: both libraries in one process would load two versions of VTK's C++
library. In a slice points are (x, z, 0), in a block (x, y, z).
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

from iceslide_fem.postprocess.results import field_files, field_parts
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.columns import CONTACT, STRESS
from iceslide_fem.runtime.errors import SceneError

SAME_POINT = 1e-9  # of the size of a grid
# Quadratic cells list their corners first: (corners, VTK's linear cell).
_LINEAR = {
    pv.CellType.QUADRATIC_TRIANGLE: (3, pv.CellType.TRIANGLE),
    pv.CellType.BIQUADRATIC_QUAD: (4, pv.CellType.QUAD),
    pv.CellType.QUADRATIC_TETRA: (4, pv.CellType.TETRA),
    pv.CellType.TRIQUADRATIC_HEXAHEDRON: (8, pv.CellType.HEXAHEDRON),
}


class Interface(NamedTuple):
    """Contact facets: ordered corners (f, c, 3), m, and means (f,)."""

    corners: Array
    values: Mapping[str, Array]

    @property
    def flat(self) -> bool:
        """Whether it is a slice, with lines as facets."""
        return self.corners.shape[1] == 2

    @property
    def touching(self) -> Mask:
        """Mask of facets in contact (f,)."""
        return np.asarray(self.values[CONTACT.name] > 0.0)


class Snapshot(NamedTuple):
    """The deformed rubber, its contact facets and a section of the ice at `time` (s).

    rubber: the outer surface (in a slice the cells) with the contact pressure, NaN without contact;
    ice: triangles of the section y = 0 with the temperature in degC as point data, or None;
    undeformed: lowest and highest corner of the undeformed block (2, 3), m. A symmetric block has
    both halves.
    """

    time: float
    rubber: pv.PolyData
    interface: Interface
    ice: pv.PolyData | None
    undeformed: Array


def times(directory: Path) -> Array:
    """Times (s) of rubber and interface in a run's directory; empty without both."""
    both = zip(field_files(directory, "rubber"), field_files(directory, "interface"), strict=False)
    return np.array([time for (time, _), _ in both])


def read_mises(directory: Path, number: int) -> Array | None:
    """Von Mises stresses (Pa) at the rubber's nodes, if they were written."""
    data = _read(field_parts(directory, "rubber")[number][1]).point_data
    return np.asarray(data[STRESS.name]) if STRESS.name in data else None


@contextlib.contextmanager
def _as_written(directory: Path) -> Iterator[None]:
    """Context in which errors of damaged fields become SceneError."""
    try:
        yield
    except (LookupError, OSError, TypeError, ValueError) as error:
        raise SceneError(
            f"the fields in {directory / 'fields'} are not what a run wrote ({error})"
        ) from None


def _read(parts: list[Path]) -> Any:
    """The grid from the VTK files of its parts. Truncated files are refused first."""
    for path in parts:
        if b"</VTKFile>" not in path.read_bytes()[-40:]:
            raise SceneError(f"{path} is not whole: its end is missing")
    if len(parts) == 1:
        return pv.read(parts[0])
    # Points at the border of two parts are merged.
    return pv.merge([pv.read(path) for path in parts]).clean(tolerance=SAME_POINT)


def read_interface(directory: Path, number: int) -> Interface:
    """The contact facets at the output `number` (half of a symmetric block).

    Raises SceneError if a file is damaged.
    """
    with _as_written(directory):
        grid = _read(field_parts(directory, "interface")[number][1])
        connectivity = grid.cell_connectivity.reshape(grid.n_cells, -1)
        values = {name: np.asarray(grid.cell_data[name]) for name in grid.cell_data}
        return Interface(np.asarray(grid.points)[connectivity], values)


def read_snapshot(directory: Path, number: int) -> Snapshot:
    """The fields at the output `number` (0, 1, ...). Raises SceneError if one is damaged."""
    with _as_written(directory):
        time, _ = field_parts(directory, "interface")[number]
        interface = read_interface(directory, number)
        grid = _read_linear(field_parts(directory, "rubber")[number][1])
        undeformed = np.array([grid.points.min(axis=0), grid.points.max(axis=0)])
        grid.points = grid.points + grid.point_data["displacement"]
        rubber = grid.extract_surface(algorithm="geometry")
        if not interface.flat:
            _put_pressure(rubber, interface)
            if rubber.bounds.y_min > -1e-6 * rubber.length:  # half a block
                rubber, interface = _with_mirror_image(rubber, interface)
                undeformed[0, 1] = -undeformed[1, 1]
        ice_files = field_parts(directory, "ice")
        ice = _ice_section(ice_files[number][1], interface.flat) if ice_files else None
        return Snapshot(time, rubber, interface, ice, undeformed)


def _ice_section(parts: list[Path], flat: bool) -> pv.PolyData:
    """Triangles of the ice in the plane y = 0."""
    grid = _read(parts)
    if flat:
        return grid.extract_surface(algorithm="geometry").triangulate()
    # just inside the cells: the symmetry plane is a cell face
    return grid.slice("y", origin=(0.0, 1e-6 * grid.length, 0.0)).triangulate()


def _read_linear(parts: list[Path]) -> pv.UnstructuredGrid:
    """Cells by their corners."""
    grid = _read(parts)
    corners, kind = _LINEAR[pv.CellType(grid.celltypes[0])]
    cells = grid.cell_connectivity.reshape(grid.n_cells, -1)[:, :corners]
    used, cells = np.unique(cells, return_inverse=True)
    linear = pv.UnstructuredGrid({kind: cells.reshape(-1, corners)}, np.array(grid.points[used]))
    for name in grid.point_data:
        linear.point_data[name] = grid.point_data[name][used]
    return linear


def _put_pressure(rubber: pv.PolyData, interface: Interface) -> None:
    """Assign the pressure of contact facets to the surface's faces."""
    centres = rubber.cell_centers().points
    distance, facet = cKDTree(interface.corners.mean(axis=1)).query(centres)
    pressure = np.where(interface.touching, interface.values[CONTACT.name], np.nan)[facet]
    rubber.cell_data[CONTACT.name] = np.where(distance < 1e-5 * rubber.length, pressure, np.nan)


def _with_mirror_image(rubber: pv.PolyData, interface: Interface) -> tuple[pv.PolyData, Interface]:
    """Both with their mirror images at the symmetry plane y = 0."""
    corners = np.concatenate([interface.corners, [1.0, -1.0, 1.0] * interface.corners])
    values = {name: np.tile(mean, 2) for name, mean in interface.values.items()}
    return rubber.merge(rubber.reflect((0, 1, 0))), Interface(corners, values)
