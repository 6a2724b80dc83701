"""A user's own mesh of a tread block: read, checked, and refused with a reason.

What a mesh must be: coordinates in `rubber.mesh_unit`, vertical last (a slice lies in the file's
x-y plane, y up), the ice plane at 0. Cells of one type (triangles, quadrilaterals, tetrahedra or
hexahedra, first order) named `rubber`, which fill the body once (`soundness`); outer facets named
`contact` (all that may touch the ice, with all that lie on it), `plate` (on the flat top), for half
a block `symmetry` (at y = 0), and, where walls of sipes shall meet, `walls`.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from iceslide_fem.mesh import readers
from iceslide_fem.mesh.completeness import gap
from iceslide_fem.mesh.named_cells import MeshFile, rubber_file
from iceslide_fem.mesh.soundness import Soundness
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.errors import SceneError

SIZES = 1e-5, 0.3  # m; what is smaller or larger was drawn in another unit


def load_user_mesh(path: Path | str, dim: int, unit: str = "m") -> TaggedMesh:
    """Read and check a user's mesh of dimension `dim` (2 for a slice, 3 for a block).

    `unit` (`readers.UNITS`) is that of its coordinates; those of the result are in m. Raises
    SceneError with a sentence that names the file, what is wrong with it and where.
    """
    file = rubber_file(Path(path), dim)
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
    """Raise SceneError if the parts of a mesh are not where the module's docstring says."""
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
