"""A block of any outline: gmsh meshes its polygon by quadrilaterals and sweeps them upwards.

Cells are smallest at the outline and, as in the built-in block, at the ice and at the plate. If the
outline is symmetric in y, half of it is meshed.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import gmsh
import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.mesh.box import EDGE_CELL, EDGE_SLOPE, LARGEST_CELL, box_lines, reference_cells
from iceslide_fem.mesh.gmsh_model import QUADRILATERALS, empty_model, grade, nodes_of
from iceslide_fem.mesh.grid import snapped, with_parts
from iceslide_fem.mesh.profile import part_choosers
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.mesh.soundness import Soundness, place
from iceslide_fem.mesh.swept import NEAR
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.outline_file import area, read_outline

MIRRORED = 1e-6  # of the size: tolerance of mirrored corners


def outline_mesh(
    path: Path, height: float, refinement: float, layers: tuple[float, ...] = ()
) -> TaggedMesh:
    """Mesh of the block of the outline at `path` and of this height (m), on this rank alone.

    layers: heights where layers of other rubber begin, m. Raises SceneError if it can't be meshed.
    """
    changed = path.stat().st_mtime_ns if path.exists() else 0
    return _built(path, changed, height, refinement, layers)


@lru_cache(maxsize=2)  # a scene asks for its mesh several times
def _built(
    path: Path, changed: int, height: float, refinement: float, layers: tuple[float, ...]
) -> TaggedMesh:
    rings = read_outline(path, "rubber.outline")
    (left, low), (right, high) = rings[0].min(axis=0), rings[0].max(axis=0)
    symmetric = _is_symmetric(rings)
    sides = [(left, right), (0.0 if symmetric else low, high)]
    block = BlockShape(sides, height, symmetric, layers=layers)
    z = box_lines(block, refinement)[-1]
    try:
        points, cells = _sweep(rings, symmetric, z, *reference_cells(block, refinement))
    except SceneError:
        raise
    except Exception as error:  # gmsh has no specific error
        reason = " ".join(str(error).split())
        raise SceneError(f"rubber.outline: {path} can't be meshed: {reason}") from None
    points[:, 2] = snapped(points[:, 2], z)
    if symmetric:
        points[np.abs(points[:, 1]) <= NEAR * height, 1] = 0.0
    tagged = with_parts(points, cells, "rubber", part_choosers(block))
    fault = Soundness(tagged).fault(tagged.facets["plate"])
    if fault is not None:
        what, where = fault
        raise SceneError(
            f"rubber.outline: {path} can't be meshed: near {place(where)} {what}; smooth the "
            "outline or raise numerics.refinement"
        )
    return tagged


def _is_symmetric(rings: tuple[Array, ...]) -> bool:
    """Whether every corner has its mirror image in y among the corners of the same polygon."""
    near = MIRRORED * float(np.ptp(rings[0], axis=0).max())
    mirrored = (cKDTree(ring).query(ring * [1.0, -1.0])[0] for ring in rings)
    return all(distance.max() <= near for distance in mirrored)


def _sweep(
    rings: tuple[Array, ...], symmetric: bool, z: Array, cells: list[float], reach: float
) -> tuple[Array, IntArray]:
    """Nodes (n, 3), m, and hexahedra of the area within `rings` between the heights z.

    Cell sizes are as in the built-in block: reference `cells` (m) and reference length of slopes.
    """
    size = float(np.ptp(rings[0], axis=0).max())
    smallest, largest = EDGE_CELL * cells[-1] / size, LARGEST_CELL * cells[-1] / size
    slope = EDGE_SLOPE * EDGE_CELL * cells[-1] / reach
    with empty_model() as model:
        loops = []
        for ring in rings:
            # with the other orientation OpenCASCADE fills the hole instead
            ring = ring if area(ring) > 0.0 else ring[::-1]
            corners = [model.occ.addPoint(*corner, 0.0) for corner in (ring / size).tolist()]
            ends = zip(corners, corners[1:] + corners[:1], strict=True)
            loops.append(model.occ.addCurveLoop([model.occ.addLine(*pair) for pair in ends]))
        face = [(2, model.occ.addPlaneSurface(loops))]
        if symmetric:
            left, right = rings[0][:, 0].min() / size, rings[0][:, 0].max() / size
            half = model.occ.addRectangle(left - 1.0, 0.0, 0.0, right - left + 2.0, 2.0)
            face, _ = model.occ.intersect(face, [(2, half)])
        layers = [1] * (len(z) - 1), (z[1:] / z[-1]).tolist()
        model.occ.extrude(face, 0.0, 0.0, float(z[-1]) / size, *layers, recombine=True)
        model.occ.synchronize()
        border = [tag for _, tag in model.getBoundary(face, oriented=False)]
        outer = [tag for tag in border if not (symmetric and _on_axis(model, tag))]
        for curve in outer:  # gmsh needs two cells for quadrilaterals
            pairs = max(round(model.occ.getMass(1, curve) / (2.0 * smallest)), 1)
            model.mesh.setTransfiniteCurve(curve, 2 * pairs + 1)
        grade(model, "CurvesList", outer, (smallest, slope, largest), 200, QUADRILATERALS)
        for _, surface in face:
            model.mesh.setRecombine(2, surface)
        model.mesh.generate(3)
        kinds, _, nodes = model.mesh.getElements(3)
        if list(kinds) != [5]:
            raise SceneError("rubber.outline can't be filled with hexahedra; smooth the outline")
        points, hexahedra = nodes_of(model, nodes[0])
    return points * size, hexahedra.reshape(-1, 8)


def _on_axis(model: gmsh.model, curve: int) -> bool:
    """Whether a curve lies on y = 0, within gmsh's enlargement of bounding boxes."""
    _, low, _, _, high, _ = model.getBoundingBox(1, curve)
    return max(abs(low), abs(high)) < 1.1e-6
