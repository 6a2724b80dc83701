"""A user's own mesh of a tread block: read, checked, and refused with a reason.

What a mesh must be: coordinates in metres, vertical last (a slice lies in the file's x-y plane,
y up), the ice plane at 0. Cells of one type (triangles, quadrilaterals, tetrahedra or
hexahedra, first order) named `rubber`; outer facets named `contact` (all that may touch the ice,
with the lowest points), `plate` (on the flat top) and, for half a block, `symmetry` (at y = 0).

gmsh files name parts by physical groups. In other files, read by meshio, a name is a cell set, a
MED family, or cell data of that name that are not zero; facets must be cells of their own.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterator
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from numpy.typing import NDArray

from iceslide_fem.errors import SceneError
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.gmsh_model import TaggedMesh

PARTS = ("contact", "plate", "symmetry")
LARGEST = 1.0  # m; what is larger was drawn in other units
TOLERANCE = 1e-6  # of the height, for what must lie in a plane

_MESHIO_KINDS = {"quad": "quadrilateral", "tetra": "tetrahedron"}
_FACETS = {
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quadrilateral": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetrahedron": [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)],
    "hexahedron": [
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    ],
}


def load_user_mesh(path: Path | str, dim: int) -> TaggedMesh:
    """Read and check a user's mesh of dimension `dim` (2 for a slice, 3 for a block).

    Raises SceneError with a sentence that names the file and what is wrong with it.
    """
    path = Path(path)
    read = gmsh_model.load if path.suffix == ".msh" else _load_by_meshio
    tagged = read(path, dim, "rubber")
    for name in ("contact", "plate"):
        if name not in tagged.facets:
            found = ", ".join(tagged.facets) or "none"
            raise SceneError(f'mesh {path} has no facets tagged "{name}"; tags found: {found}')
    known = {name: tagged.facets[name] for name in PARTS if name in tagged.facets}
    tagged = tagged._replace(facets=known)
    _check_placement(path, tagged)
    return tagged


def _check_placement(path: Path, tagged: TaggedMesh) -> None:
    """Raise SceneError if the parts of a mesh are not where the module's docstring says."""
    points, height = tagged.points, tagged.points[:, -1].max()
    near = TOLERANCE * np.ptp(points[:, -1])
    size = np.ptp(points, axis=0).max()
    if size > LARGEST:
        raise SceneError(f"mesh {path} is {size:g} m large; its coordinates must be in metres")
    if near <= TOLERANCE**2 * size:
        raise SceneError(
            f"mesh {path} has no height; a slice lies in the plane of x and y, with y upwards"
        )
    lowest = points[:, -1].min()
    if abs(lowest) > near:
        raise SceneError(
            f"mesh {path}: the lowest point is at {lowest:g} m; move the mesh by {-lowest:g} m so "
            "that it is at 0, the ice"
        )
    _check_facets(path, tagged)
    plate = points[tagged.facets["plate"], -1]
    if np.ptp(plate) > near:
        raise SceneError(
            f'mesh {path}: facets tagged "plate" are not flat, they reach from {plate.min():g} m '
            f"to {plate.max():g} m; they must lie on the top at {height:g} m"
        )
    if height - plate.min() > near:
        raise SceneError(
            f'mesh {path}: facets tagged "plate" are at {plate.min():g} m; they must lie on the '
            f"top at {height:g} m"
        )
    touching = points[tagged.facets["contact"], -1]
    if touching.min() > near:
        raise SceneError(
            f'mesh {path}: facets tagged "contact" begin at {touching.min():g} m; they must '
            "include the lowest points at 0 m"
        )
    if (touching.min(axis=1) > height - near).any():
        raise SceneError(f'mesh {path}: facets tagged "contact" lie on the top, where the plate is')
    if "symmetry" in tagged.facets:
        across = points[tagged.facets["symmetry"], 1]
        if len(tagged.points[0]) == 2:
            raise SceneError(f'mesh {path}: "symmetry" has no meaning in a slice')
        if abs(across).max() > near or points[:, 1].min() < -near:
            raise SceneError(
                f'mesh {path}: facets tagged "symmetry" must be at y = 0 and the block at y >= 0'
            )


def mesh_size(tagged: TaggedMesh) -> dict[str, float]:
    """Cells, nodes of the quadratic elements, smallest and largest cell edge in m."""
    facets = _facets(tagged)
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


def _facets(tagged: TaggedMesh) -> NDArray[np.int64]:
    """Facets of all cells, inner ones twice: (cells * facets of a cell, corners of a facet)."""
    facets = tagged.cells[:, np.array(_FACETS[tagged.cell_type])]
    return facets.reshape(-1, facets.shape[-1])


def _check_facets(path: Path, tagged: TaggedMesh) -> None:
    """Raise SceneError if a tagged facet is empty, inside the body or tagged twice."""
    occurrences = Counter(map(tuple, np.sort(_facets(tagged), axis=1).tolist()))
    owner: dict[tuple[int, ...], str] = {}
    for name, nodes in tagged.facets.items():
        for facet in map(tuple, np.sort(nodes, axis=1).tolist()):
            if occurrences[facet] != 1:
                raise SceneError(
                    f'mesh {path}: facets tagged "{name}" are not on the outside of "rubber"'
                )
            if facet in owner:
                raise SceneError(f'mesh {path}: a facet is tagged "{owner[facet]}" and "{name}"')
            owner[facet] = name


def _load_by_meshio(path: Path, dim: int, body: str) -> TaggedMesh:
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # on a bad file meshio prints and exits
        reason = " ".join((said.getvalue() or str(error)).split())
        raise SceneError(f"mesh {path} can't be read by meshio: {reason}") from None
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
