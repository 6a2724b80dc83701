"""Number of unknowns of a scene and its memory, estimated before meshing."""

from __future__ import annotations

import math
from typing import NamedTuple

from iceslide_fem.mesh.ice import ice_shape, window_lines
from iceslide_fem.mesh.ice_body import ice_nodes
from iceslide_fem.mesh.rubber import block_shape, divisions
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import memory_of_machine
from iceslide_fem.scene import Scene

# Bytes, measured by scripts.studies.accuracy_cost
PROGRAMS = 0.24e9
PER_UNKNOWN = 2e3  # mesh, forms, vectors and matrix
PLANE_FACTORS = 50.0  # of the direct solver in a slice, per n log2(n)
FACTORS = 570.0  # in a block, per n^(4/3)
PER_COLUMN = 5e3  # of sliding ice
# Continuum ice has as many modes along an axis as nodes. This number takes some 15 s.
MOST_MODES = 3000


class Unknowns(NamedTuple):
    """Sizes of a scene.

    Dimension of the meshes; displacement unknowns of rubber; unknowns of meshed ice; columns of
    sliding ice; nodes of continuum ice in its longest line.
    """

    dimensions: int
    rubber: int
    ice: int
    columns: int
    longest: int = 0


def unknowns(scene: Scene) -> Unknowns:
    """Sizes of a slice or a block. Raises SceneError if the user's mesh is unsuitable."""
    dimensions = 2 if scene.model == "slice" else 3
    rubber = dimensions * int(divisions(scene)["quadratic_nodes"])
    if scene.ice.heat == "continuum":
        shape = ice_shape(scene)
        return Unknowns(dimensions, rubber, math.prod(shape), 0, max(shape))
    if scene.ice.heat == "mesh":
        return Unknowns(dimensions, rubber, ice_nodes(scene), 0)
    if scene.ice.motion == "attached":
        return Unknowns(dimensions, rubber, 0, 0)
    lines = window_lines(scene, block_shape(scene).ranges)
    return Unknowns(dimensions, rubber, 0, math.prod(len(line) for line in lines))


def memory_needed(size: Unknowns) -> float:
    """Memory of a run in one process, bytes.

    The rubber's factors grow as n log n in a slice and as n^(4/3) in a block; ice has no factors.
    """
    n = size.rubber
    plane = size.dimensions == 2
    factors = PLANE_FACTORS * n * math.log2(max(n, 2)) if plane else FACTORS * n ** (4 / 3)
    return PROGRAMS + PER_UNKNOWN * (n + size.ice) + factors + PER_COLUMN * size.columns


def shortage(scene: Scene) -> str | None:
    """Message if a run of `scene` needs more memory or modes than available, else None.

    Raises SceneError if the user's mesh can't be used.
    """
    if scene.model == "point":
        return None
    size = unknowns(scene)
    needed, present = memory_needed(size), memory_of_machine()
    if needed > present:
        ice = f"{size.columns} columns of ice" if size.columns else f"{size.ice} of ice"
        return (
            f"needs about {needed / 1e9:.3g} GB of memory "
            f"({size.rubber} unknowns of rubber, {ice}), and there are {present / 1e9:.3g} GB"
        )
    if size.longest > MOST_MODES:
        return (
            f"needs a mesh of the ice with {size.longest} nodes in a line, and continuum ice may "
            f'have {MOST_MODES} (ice.heat = "column" any number)'
        )
    return None


def check_memory(scene: Scene) -> None:
    """Raise SceneError if a run of `scene` needs more memory, or modes, than there is."""
    short = shortage(scene)
    if short:
        raise SceneError(
            f"{scene.name} {short}: its lengths are too far apart, or numerics.refinement, "
            "ice.cell, ice.trail or ice.margin ask for too much"
        )
