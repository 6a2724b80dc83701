"""A user's own mesh of a tread block: read, checked, and refused with a reason.

What a mesh must be: coordinates in `rubber.mesh_unit`, vertical last (a slice lies in the file's
x-y plane, y up), the ice plane at 0. Cells of one type (triangles, quadrilaterals, tetrahedra or
hexahedra, first order) named `rubber`, which fill the body once (`soundness`); outer facets named
`contact` (all that may touch the ice, with all that lie on it), `plate` (on the flat top), for half
a block `symmetry` (at y = 0), and, where walls of sipes shall meet, `walls`.

gmsh files name parts by physical groups. In other files, read by meshio, a name is a cell set, a
MED family, or cell data of that name that are not zero; facets must be cells of their own.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import redirect_stderr
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.errors import SceneError
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.gmsh_model import IntArray, TaggedMesh
from iceslide_fem.mesh.soundness import Soundness, facets_of, place

PARTS = ("contact", "plate", "symmetry", "walls")
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}  # of coordinates, in m
SMALLEST, LARGEST = 1e-5, 0.3  # m; what is smaller or larger was drawn in another unit
LARGEST_FILE = 1_000_000_000  # bytes
TOLERANCE = 1e-6  # of the height, for what must lie in a plane

_MESHIO_KINDS = {"quad": "quadrilateral", "tetra": "tetrahedron"}


def load_user_mesh(path: Path | str, dim: int, unit: str = "m") -> TaggedMesh:
    """Read and check a user's mesh of dimension `dim` (2 for a slice, 3 for a block).

    `unit` (`UNITS`) is that of its coordinates; those of the result are in m. Raises SceneError
    with a sentence that names the file, what is wrong with it and where.
    """
    path = Path(path)
    try:
        status = path.stat()
    except OSError as error:
        raise SceneError(f"rubber.mesh {path} can't be read: {error.strerror}") from None
    return _checked(path, dim, unit, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=2)  # a scene asks for its mesh several times
def _checked(path: Path, dim: int, unit: str, changed: int, size: int) -> TaggedMesh:
    if size > LARGEST_FILE:
        raise SceneError(
            f"rubber.mesh {path} has {size / 1e6:.0f} MB; allowed: up to "
            f"{LARGEST_FILE / 1e6:.0f} MB"
        )
    read = gmsh_model.load if path.suffix == ".msh" else _load_by_meshio
    tagged = read(path, dim, "rubber")
    for name in ("contact", "plate"):
        if name not in tagged.facets:
            found = ", ".join(tagged.facets) or "none"
            raise SceneError(
                f'rubber.mesh {path} has no facets tagged "{name}"; tags found: {found}'
            )
    known = {name: tagged.facets[name] for name in PARTS if name in tagged.facets}
    tagged = tagged._replace(points=UNITS[unit] * tagged.points, facets=known)
    _check_size(path, tagged, unit)
    soundness = Soundness(tagged)
    _check_placement(path, tagged, soundness.outer)
    fault = soundness.fault(tagged.facets["plate"])
    if fault is not None:
        what, where = fault
        raise SceneError(f"rubber.mesh {path}, near {place(where, unit, UNITS[unit], 6)}: {what}")
    return tagged


def _check_size(path: Path, tagged: TaggedMesh, unit: str) -> None:
    """Raise SceneError if coordinates are no numbers or were drawn in another unit."""
    wrong = np.flatnonzero(~np.isfinite(tagged.points).all(axis=1))
    if wrong.size:
        raise SceneError(
            f"rubber.mesh {path}: the coordinates of {wrong.size} of {len(tagged.points)} nodes "
            "are not finite numbers"
        )
    size = np.ptp(tagged.points, axis=0).max()
    if not SMALLEST <= size <= LARGEST:
        raise SceneError(
            f"rubber.mesh {path} is {size:g} m large; allowed: {SMALLEST:g} to {LARGEST:g} m; "
            f'rubber.mesh_unit = "{unit}" says in which unit it was drawn, allowed: '
            f"{', '.join(UNITS)}"
        )


def _check_placement(path: Path, tagged: TaggedMesh, outer: IntArray) -> None:
    """Raise SceneError if the parts of a mesh are not where the module's docstring says."""
    points, height = tagged.points, tagged.points[:, -1].max()
    near = TOLERANCE * np.ptp(points[:, -1])
    if near <= TOLERANCE**2 * np.ptp(points, axis=0).max():
        raise SceneError(
            f"rubber.mesh {path} has no height; a slice lies in the plane of x and y, with y "
            "upwards"
        )
    lowest = points[:, -1].min()
    if abs(lowest) > near:
        raise SceneError(
            f"rubber.mesh {path}: the lowest point is at {lowest:g} m; move the mesh by "
            f"{-lowest:g} m so that it is at 0, the ice"
        )
    _check_facets(path, tagged, outer)
    plate = points[tagged.facets["plate"], -1]
    if np.ptp(plate) > near:
        raise SceneError(
            f'rubber.mesh {path}: facets tagged "plate" are not flat, they reach from '
            f"{plate.min():g} m to {plate.max():g} m; they must lie on the top at {height:g} m"
        )
    if height - plate.min() > near:
        raise SceneError(
            f'rubber.mesh {path}: facets tagged "plate" are at {plate.min():g} m; they must lie on '
            f"the top at {height:g} m"
        )
    touching = points[tagged.facets["contact"], -1]
    if touching.min() > near:
        raise SceneError(
            f'rubber.mesh {path}: facets tagged "contact" begin at {touching.min():g} m; they must '
            "include the lowest points at 0 m"
        )
    if (touching.min(axis=1) > height - near).any():
        raise SceneError(
            f'rubber.mesh {path}: facets tagged "contact" lie on the top, where the plate is'
        )
    if "symmetry" in tagged.facets:
        across = points[tagged.facets["symmetry"], 1]
        if len(tagged.points[0]) == 2:
            raise SceneError(f'rubber.mesh {path}: "symmetry" has no meaning in a slice')
        if abs(across).max() > near or points[:, 1].min() < -near:
            raise SceneError(
                f'rubber.mesh {path}: facets tagged "symmetry" must be at y = 0 and the '
                "block at y >= 0"
            )


def mesh_size(tagged: TaggedMesh) -> dict[str, float]:
    """Cells, nodes of the quadratic elements, smallest and largest cell edge in m."""
    facets = facets_of(tagged)
    pairs = np.concatenate([facets, np.roll(facets, 1, axis=1)]).reshape(2, -1).T
    edges = np.unique(np.sort(pairs, axis=1), axis=0)
    lengths = np.linalg.norm(np.diff(tagged.points[edges], axis=1), axis=-1)
    nodes = len(tagged.points) + len(edges)
    if tagged.cell_type in ("quadrilateral", "hexahedron"):
        nodes += len(tagged.cells)
    if tagged.cell_type == "hexahedron":
        nodes += len(np.unique(np.sort(facets, axis=1), axis=0))
    return {
        "cells": len(tagged.cells),
        "quadratic_nodes": nodes,
        "smallest_m": float(lengths.min()),
        "largest_m": float(lengths.max()),
    }


def _check_facets(path: Path, tagged: TaggedMesh, outer: IntArray) -> None:
    """Raise SceneError if a tagged facet is none of the `outer` ones, or tagged twice, or if one
    that lies on the ice has no tag.
    """
    sets = [outer, *tagged.facets.values()]
    _, numbers = np.unique(np.sort(np.concatenate(sets), axis=1), axis=0, return_inverse=True)
    outside, *named = np.split(numbers.ravel(), np.cumsum([len(part) for part in sets])[:-1])
    owner: dict[int, str] = {}
    for name, members in zip(tagged.facets, named, strict=True):
        if not np.isin(members, outside).all():
            raise SceneError(
                f'rubber.mesh {path}: facets tagged "{name}" are not on the outside of "rubber"'
            )
        for facet in members.tolist():
            if facet in owner:
                raise SceneError(
                    f'rubber.mesh {path}: a facet is tagged "{owner[facet]}" and "{name}"'
                )
            owner[facet] = name
    near = TOLERANCE * np.ptp(tagged.points[:, -1])
    on_ice = outer[(tagged.points[outer, -1] <= near).all(axis=1) & ~np.isin(outside, [*owner])]
    if len(on_ice):
        x = tagged.points[on_ice[0], 0].mean()
        raise SceneError(
            f"rubber.mesh {path}: {len(on_ice)} facets lie on the ice and are not tagged "
            f'"contact", the first at x = {x:g} m'
        )


def _load_by_meshio(path: Path, dim: int, body: str) -> TaggedMesh:
    import meshio  # takes long to import

    said = io.StringIO()
    try:
        with redirect_stderr(said):
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # on a bad file meshio prints and exits
        reason = " ".join((said.getvalue() or str(error)).split())
        raise SceneError(f"rubber.mesh {path} can't be read by meshio: {reason}") from None
    if mesh.points.ndim != 2 or mesh.points.shape[1] not in (2, 3):
        raise SceneError(f"rubber.mesh {path}: its points have neither two nor three coordinates")
    coordinates = np.zeros((len(mesh.points), 3))
    coordinates[:, : mesh.points.shape[1]] = mesh.points
    blocks = []
    for name, number, marked in _names(mesh):
        if marked.any():
            cells = mesh.cells[number]
            kind = _MESHIO_KINDS.get(cells.type, cells.type)
            blocks.append((name, cells.dim, kind, cells.data[marked].astype(np.int64)))
    numbers = np.arange(len(coordinates))
    return gmsh_model.from_blocks(path, dim, body, numbers, coordinates, blocks)


def _names(mesh: Any) -> Iterator[tuple[str, int, NDArray[np.bool_]]]:
    """(name, number of a cell block, which of its cells have that name)."""
    # MED: an element belongs to one family, which may have several names
    families = [
        (name, family) for family, names in getattr(mesh, "cell_tags", {}).items() for name in names
    ]
    for number, cells in enumerate(mesh.cells):
        for name, members in mesh.cell_sets.items():
            if not name.startswith("gmsh:") and members[number] is not None:
                yield name, number, np.isin(np.arange(len(cells)), members[number])
        for name, data in mesh.cell_data.items():
            values = np.asarray(data[number])
            if name == "cell_tags":
                for group, family in families:
                    yield group, number, values == family
            elif name == "gmsh:physical":
                for group, (tag, dim) in mesh.field_data.items():
                    yield group, number, (values == tag) & (cells.dim == dim)
            elif values.ndim == 1:
                yield name, number, values != 0
