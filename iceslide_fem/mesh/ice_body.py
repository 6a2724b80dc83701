"""The mesh of the ice and the layers below it, for heat on a mesh: built-in or the user's.

Cells are upright: the last axis of each is the steepest one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.ice import ice_cells, ice_shape, surface_lines, tagged_ice
from iceslide_fem.mesh.rubber import block_shape
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.mesh.user_mesh import load_user_ice
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.outline_file import area

MISSING = 1e-6  # fraction of the footprint allowed without ice, for rounding
# Corners of a cell as gmsh numbers them, in the order of its axes: the last index counts fastest.
_CORNERS = {
    "quadrilateral": np.array([0, 3, 1, 2]).reshape(2, 2),
    "hexahedron": np.array([0, 4, 3, 7, 1, 5, 2, 6]).reshape(2, 2, 2),
}


def ice_body(
    scene: Scene,
    surface: Sequence[Lines] | None = None,
    heated: ArrayLike | None = None,
) -> TaggedMesh:
    """The scene's ice with its regions ("ice" and the names of its layers), on this rank.

    Parts are `surface`, `base`, `symmetry` and `sides`; cells are upright quadrilaterals or
    hexahedra. surface: lines of x (and y), m, by default those below the undeformed block; heated:
    heating times of runs, s, by default the scene's. A user's mesh ignores both. Raises SceneError
    if a user's mesh is unsuitable.
    """
    if scene.ice.mesh is not None:
        return _user_ice(scene, scene.ice.mesh)
    lines = surface or surface_lines(scene, block_shape(scene).ranges)
    return upright(tagged_ice(ice_cells(scene, lines, heated), scene.ice.stack))


def ice_nodes(scene: Scene) -> int:
    """Number of nodes of the scene's ice; elements are quadratic downwards only."""
    if scene.ice.mesh is not None:
        tagged = ice_body(scene)
        return len(tagged.points) + len(upright_edges(tagged))
    return math.prod(ice_shape(scene))


def upright(tagged: TaggedMesh) -> TaggedMesh:
    """The same mesh of quadrilaterals or hexahedra with its cells turned upright."""
    order = _CORNERS[tagged.cell_type]
    corners = tagged.points[tagged.cells[:, order]]  # (cells, 2, ..., 2, dim)
    axes = range(order.ndim)
    steep = []
    for axis in axes:
        along = np.diff(corners, axis=axis + 1).reshape(len(corners), -1, len(axes)).mean(axis=1)
        steep.append(np.abs(along[:, -1]) / np.linalg.norm(along, axis=1))
    vertical = np.argmax(steep, axis=0)
    cells = tagged.cells.copy()
    for axis in axes:
        some = vertical == axis
        turned = np.transpose(order, np.roll(axes, len(axes) - 1 - axis))
        cells[np.ix_(some, order.ravel())] = tagged.cells[some][:, turned.ravel()]
    return tagged._replace(cells=cells)


def upright_edges(tagged: TaggedMesh) -> IntArray:
    """Nodes (n, 2) of the edges that lead down, in a mesh whose cells stand `upright`."""
    edges = tagged.cells[:, _CORNERS[tagged.cell_type]].reshape(-1, 2)
    return np.unique(np.sort(edges, axis=1), axis=0)


def covered(corners: Array, ranges: Sequence[tuple[float, float]]) -> float:
    """Fraction of a rectangle (a line in a slice) that facets cover.

    corners: of convex facets without overlap, (n, k, d-1), m; ranges: of the rectangle, m.
    """
    from matplotlib import path, transforms  # takes long to import

    low, high = np.array(ranges).T
    found: float
    if len(ranges) == 1:
        found = float(np.ptp(np.clip(corners, low, high), axis=1).sum())
    else:
        rectangle = transforms.Bbox([low, high])
        inside = (path.Path(facet).clip_to_bbox(rectangle).to_polygons() for facet in corners)
        found = sum(abs(area(np.array(piece))) for pieces in inside for piece in pieces)
    return found / float(np.prod(high - low))


def _user_ice(scene: Scene, path: Path) -> TaggedMesh:
    """The user's mesh. Raises SceneError if it does not fit the scene's rubber and base."""
    ice, block = scene.ice, block_shape(scene)
    dim = len(block.ranges) + 1
    tagged = load_user_ice(path, dim, ice.mesh_unit, [layer.name for layer in ice.stack[1:]])
    tags = ", ".join(name for name in tagged.facets if name != "sides")
    if ice.base == "held" and "base" not in tagged.facets:
        raise SceneError(
            f'ice.mesh {path} has no facets tagged "base", where ice.base = "held" holds the '
            f"temperature; tags found: {tags}"
        )
    if dim == 3 and block.symmetric and "symmetry" not in tagged.facets:
        raise SceneError(
            f'ice.mesh {path} has no facets tagged "symmetry", and the rubber is the half of a '
            f"block with y >= 0: cut the ice at y = 0, too; tags found: {tags}"
        )
    if dim == 3 and not block.symmetric and "symmetry" in tagged.facets:
        raise SceneError(
            f'ice.mesh {path} has facets tagged "symmetry", and rubber.mesh is a whole block; '
            "allowed: halves of both, or the whole of both"
        )
    fraction = covered(tagged.points[tagged.facets["surface"], :-1], block.ranges)
    if fraction < 1.0 - MISSING:
        over = " and ".join(
            f"{axis} from {1e3 * low:.6g} to {1e3 * high:.6g} mm"
            for axis, (low, high) in zip("xy", block.ranges, strict=False)
        )
        raise SceneError(
            f'ice.mesh {path}: facets tagged "surface" leave {100.0 * (1.0 - fraction):.2g} % of '
            f"the rubber's footprint, {over}, without ice; they must cover all of it"
        )
    return upright(tagged)
