"""A user's own mesh of a tread block: read, checked, and refused with a reason.

What a mesh must be: coordinates in `rubber.mesh_unit`, vertical last (a slice lies in the file's
x-y plane, y up), the ice plane at 0. Cells of one type (triangles, quadrilaterals, tetrahedra or
hexahedra, first order) named `rubber`, which fill the body once (`soundness`); outer facets named
`contact` (all that may touch the ice, with all that lie on it), `plate` (on the flat top), for half
a block `symmetry` (at y = 0), and, where walls of sipes shall meet, `walls`.

The suffix decides who reads a file, and what a name is: a physical group or a MED group
(`gmsh_model`), a set or a surface (`abaqus`), cell data that are not zero (`vtk_cells`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from iceslide_fem.errors import SceneError
from iceslide_fem.mesh import abaqus, gmsh_model, vtk_cells
from iceslide_fem.mesh.completeness import gap
from iceslide_fem.mesh.named_cells import PARTS
from iceslide_fem.mesh.soundness import Soundness, facets_of, place
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.scene.companions import companions

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}  # of coordinates, in m
SMALLEST, LARGEST = 1e-5, 0.3  # m; what is smaller or larger was drawn in another unit
LARGEST_FILE = 1_000_000_000  # bytes
TOLERANCE = 1e-6  # of the height, for what must lie in a plane

READERS: dict[str, Callable[[Path, int, str], TaggedMesh]] = {  # by suffixes
    ".msh": gmsh_model.load,
    ".med": gmsh_model.load,
    ".inp": abaqus.load,
    ".xdmf": vtk_cells.load,
    ".xmf": vtk_cells.load,
    ".vtu": vtk_cells.load,
    ".vtk": vtk_cells.load,
}
_NASTRAN = (".bdf", ".nas", ".fem", ".dat")


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
    if status.st_size > LARGEST_FILE:
        raise SceneError(
            f"rubber.mesh {path} has {status.st_size / 1e6:.0f} MB; allowed: up to "
            f"{LARGEST_FILE / 1e6:.0f} MB"
        )
    changed = [file.stat().st_mtime_ns for file in companions(path)]
    return _checked(path, dim, unit, (status.st_size, status.st_mtime_ns, *changed))


@lru_cache(maxsize=2)  # a scene asks for its mesh several times
def _checked(path: Path, dim: int, unit: str, stamps: tuple[int, ...]) -> TaggedMesh:
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise SceneError(f"rubber.mesh {path}: {_other_format(path.suffix.lower())}")
    tagged = reader(path, dim, "rubber")
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
    near = TOLERANCE * np.ptp(tagged.points[:, -1])
    fault = soundness.fault(tagged.facets["plate"]) or gap(tagged, soundness.outer, near)
    if fault is not None:
        what, where = fault
        raise SceneError(f"rubber.mesh {path}, near {place(where, unit, UNITS[unit], 6)}: {what}")
    return tagged


def _other_format(suffix: str) -> str:
    allowed = f"allowed are {', '.join(READERS)}"
    if suffix in _NASTRAN:
        return f"files of Nastran ({suffix}) have no names for sets of facets; {allowed}"
    what = f'files "*{suffix}" are not read' if suffix else "its name has no suffix"
    return f"{what}; {allowed}; save it as one of these with the program that made it"


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
    """Raise SceneError if a tagged facet is none of the `outer` ones, or is tagged twice."""
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
