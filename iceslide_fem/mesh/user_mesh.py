"""A user's mesh of a tread block or of ice: read, checked, and refused with a reason.

Requirements: coordinates in `rubber.mesh_unit` (`ice.mesh_unit`), vertical last (a slice lies in
the file's x-y plane, y up), the ice plane at 0. Cells are of one type and of first order, and
fill the body once (`soundness`). Outer facets have names:

- rubber of triangles, quadrilaterals, tetrahedra or hexahedra named `rubber`; `contact` (all that
  may touch the ice, with all that lie on it), `plate` (on the flat top), for half a block
  `symmetry` (at y = 0), and, where walls of sipes shall meet, `walls`;
- ice of quadrilaterals or hexahedra, the ice named `ice` and each of `ice.layers` by its name;
  `surface` (all of the ice at 0), `base` (where a temperature is held), `symmetry`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from iceslide_fem.mesh import readers
from iceslide_fem.mesh.completeness import gap, lost_symmetry
from iceslide_fem.mesh.grid import with_sides
from iceslide_fem.mesh.named_cells import MeshFile, rubber_file
from iceslide_fem.mesh.soundness import Fault, Soundness
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, among, facets_of
from iceslide_fem.runtime.errors import SceneError

SIZES, ICE_SIZES = (1e-5, 0.3), (1e-5, 3.0)  # m; other sizes are in another unit
ICE_PARTS = ("surface", "base", "symmetry")
ICE_KINDS = ("quadrilateral", "hexahedron")


def load_user_mesh(
    path: Path | str,
    dim: int,
    unit: str = "m",
    tags: Iterable[tuple[str, int]] = (),
    layers: Sequence[str] = (),
) -> TaggedMesh:
    """Read and check a user's mesh of dimension `dim` (2 for a slice, 3 for a block).

    unit: of its coordinates (`readers.UNITS`); the result is in m. tags: names and the numbers
    that stand for them in the file; layers: names of cells of other rubber. Raises SceneError with
    the file, its fault and the position.
    """
    file = rubber_file(Path(path), dim, tags, layers)
    return _checked(file, unit, readers.stamps(file))


@lru_cache(maxsize=2)  # a scene asks for its mesh several times
def _checked(file: MeshFile, unit: str, stamps: tuple[int, ...]) -> TaggedMesh:
    tagged = readers.read(file, unit, ("contact", "plate"), SIZES)
    soundness = Soundness(tagged)
    near = readers.TOLERANCE * float(np.ptp(tagged.points[:, -1]))
    _check_placement(file, tagged, soundness.outer, near)
    fault = soundness.fault(tagged.facets["plate"]) or gap(tagged, soundness.outer, near)
    readers.refuse(file, fault, unit)
    return tagged


def _check_placement(file: MeshFile, tagged: TaggedMesh, outer: IntArray, near: float) -> None:
    """Raise SceneError if the parts of a mesh are not where the module docstring requires."""
    heights = tagged.points[:, -1]
    lowest, height = heights.min(), heights.max()
    if abs(lowest) > near:
        raise SceneError(
            f"{file}: the lowest point is at {lowest:g} m; move the mesh by "
            f"{-lowest:g} m so that it is at 0, the ice"
        )
    readers.check_facets(file, tagged, outer)
    plate = heights[tagged.facets["plate"]]
    if np.ptp(plate) > near:
        raise SceneError(
            f'{file}: facets tagged "plate" are not flat, they reach from '
            f"{plate.min():g} m to {plate.max():g} m; they must lie on the top at {height:g} m"
        )
    if height - plate.min() > near:
        raise SceneError(
            f'{file}: facets tagged "plate" are at {plate.min():g} m; they must lie on '
            f"the top at {height:g} m"
        )
    touching = heights[tagged.facets["contact"]]
    if touching.min() > near:
        raise SceneError(
            f'{file}: facets tagged "contact" begin at {touching.min():g} m; they must '
            "include the lowest points at 0 m"
        )
    if (touching.min(axis=1) > height - near).any():
        raise SceneError(f'{file}: facets tagged "contact" lie on the top, where the plate is')
    readers.check_symmetry(file, tagged, "block")


def load_user_ice(
    path: Path | str, dim: int, unit: str = "m", names: Sequence[str] = ()
) -> TaggedMesh:
    """Read and check a user's mesh of ice, of dimension `dim` (2 for a slice, 3 for a block).

    unit: of its coordinates (`readers.UNITS`); the result is in m. names: of the layers below the
    ice; the regions are "ice" and these. The file may also contain rubber. Unnamed outer facets
    become `sides`. Raises SceneError with the file, its fault and the position.
    """
    file = MeshFile("ice.mesh", Path(path), dim, ("ice", *names), ICE_PARTS, beside=("rubber",))
    return _checked_ice(file, unit, readers.stamps(file))


@lru_cache(maxsize=2)  # a scene asks for its mesh several times
def _checked_ice(file: MeshFile, unit: str, stamps: tuple[int, ...]) -> TaggedMesh:
    tagged = readers.read(file, unit, ("surface",), ICE_SIZES)
    if tagged.cell_type not in ICE_KINDS:
        advice = 'draw it as a transfinite mesh and recombine it (gmsh: "Transfinite", "Recombine")'
        raise SceneError(
            f"{file} is made of {tagged.cell_type} cells, for which quadratic elements of heat "
            f"have no lumped masses; allowed are {' and '.join(ICE_KINDS)} cells: {advice}"
        )
    soundness = Soundness(tagged)
    near = readers.TOLERANCE * float(np.ptp(tagged.points[:, -1]))
    _check_surface(file, tagged, near)
    readers.check_facets(file, tagged, soundness.outer)
    readers.check_symmetry(file, tagged, "ice")
    fault = (
        soundness.fault(tagged.facets["surface"], "surface")
        or _lost_surface(tagged, soundness.outer, near)
        or lost_symmetry(tagged, soundness.outer, near)
    )
    readers.refuse(file, fault, unit)
    points = tagged.points.copy()
    points[np.unique(tagged.facets["surface"]), -1] = 0.0
    return with_sides(tagged._replace(points=points))


def _check_surface(file: MeshFile, tagged: TaggedMesh, near: float) -> None:
    """Raise SceneError unless the surface is at 0, on top of all, and of ice."""
    heights = tagged.points[tagged.facets["surface"], -1]
    low, high = float(heights.min()), float(heights.max())
    if high - low > near:
        raise SceneError(
            f'{file}: facets tagged "surface" are not flat, they reach from {low:g} m to '
            f"{high:g} m; they must lie at 0 m"
        )
    if abs(high) > near:
        raise SceneError(
            f'{file}: facets tagged "surface" are at {high:g} m; move the mesh by {-high:g} m so '
            "that they are at 0, where the rubber is"
        )
    top = float(tagged.points[:, -1].max())
    if top > near:
        raise SceneError(
            f"{file} reaches up to {top:g} m, above the surface of the ice at 0 m; allowed is "
            "nothing above it"
        )
    if not among(tagged.facets["surface"], _facets_of_ice(tagged)).all():
        raise SceneError(
            f'{file}: facets tagged "surface" are not on cells tagged "ice"; the rubber slides on '
            "ice only"
        )


def _facets_of_ice(tagged: TaggedMesh) -> IntArray:
    return facets_of(tagged._replace(cells=tagged.cells[tagged.named_cells["ice"]]))


def _lost_surface(tagged: TaggedMesh, outer: IntArray, near: float) -> Fault | None:
    """The first of the `outer` ice facets (n, corners) at 0 without the name `surface`."""
    lost = (np.abs(tagged.points[outer, -1]) <= near).all(axis=1)
    lost &= among(outer, _facets_of_ice(tagged)) & ~among(outer, tagged.facets["surface"])
    if not lost.any():
        return None
    what = 'the facet there is part of the top of the ice and not tagged "surface"'
    return what, tagged.points[outer[lost][0]].mean(axis=0)
