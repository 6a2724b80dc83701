"""Mesh of the rubber block: the built-in box, or the user's own.

Coordinates are (x, z) in a slice and (x, y, z) in a block, in m; z is vertical and the ice
plane is z = 0. The rubber moves in +x, so its leading edge is x = +length/2. A block is the
half with y >= 0 of one that is symmetric about y = 0. Cells are quadrilaterals or hexahedra.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.box import BlockShape, box_lines, sipe_ranges
from iceslide_fem.mesh.cache import cached
from iceslide_fem.mesh.gmsh_model import TaggedMesh
from iceslide_fem.mesh.grid import Lines, tensor_grid
from iceslide_fem.mesh.user_mesh import load_user_mesh, mesh_size
from iceslide_fem.parallel import from_root
from iceslide_fem.scene import Scene

if TYPE_CHECKING:  # lines and sizes are wanted where there is no MPI, too
    from iceslide_fem.fenics.compat import MPI

CONTACT_HEIGHT = 0.5  # the sides may touch the ice up to this fraction of the height


class RubberMesh(NamedTuple):
    """DOLFINx mesh and facet tags of the rubber; tags: contact, plate, symmetry -> number."""

    mesh: Any
    facet_tags: Any
    tags: dict[str, int]


def rubber_mesh(scene: Scene, comm: MPI.Comm) -> RubberMesh:
    """Mesh of the scene's rubber block, or the user's own if `rubber.mesh` names one.

    Collective. Raises SceneError if the user's mesh can't be used.
    """
    tagged = from_root(lambda: tagged_rubber(scene), comm)
    return RubberMesh(*gmsh_model.distribute(tagged, comm))


def block_size(scene: Scene) -> tuple[float, ...]:
    """Length, (in 3-D) width, and height of the rubber block in m, of a user's mesh as it is."""
    block = block_shape(scene)
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2.0
    return (*lengths, block.height)


def divisions(scene: Scene) -> dict[str, float]:
    """Size of the rubber's mesh: cells nx, ny (block only), nz of the built-in grid; cells;
    nodes of the quadratic elements; smallest and largest cell edge in m.
    """
    if scene.rubber.mesh is not None:
        return mesh_size(tagged_rubber(scene))
    block = block_shape(scene)
    lines = box_lines(block, scene.numerics.refinement)
    counts = [len(line) - 1 for line in lines]
    across = math.prod(counts[1:-1])  # cells along a sipe
    cells, nodes = math.prod(counts), math.prod(2 * n + 1 for n in counts)
    for low, high in block.sipes:
        wide = int(np.sum((lines[0] > low) & (lines[0] < high))) + 1
        tall = int(np.sum(lines[-1] < block.sipe_depth * (1.0 - 1e-9)))
        cells -= wide * tall * across
        nodes -= (2 * wide - 1) * 2 * tall * math.prod(2 * n + 1 for n in counts[1:-1])
    names = ["nx", "nz"] if len(lines) == 2 else ["nx", "ny", "nz"]
    edges = np.concatenate([np.diff(line) for line in lines])
    return dict(zip(names, counts, strict=True)) | {
        "cells": cells,
        "quadratic_nodes": nodes,
        "smallest_m": float(edges.min()),
        "largest_m": float(edges.max()),
    }


def block_shape(scene: Scene) -> BlockShape:
    """What the rubber covers: the box of the scene, or the user's mesh."""
    rubber = scene.rubber
    if rubber.mesh is not None:
        tagged = tagged_rubber(scene)
        low, high = tagged.points.min(axis=0), tagged.points.max(axis=0)
        ranges = list(zip(low[:-1], high[:-1], strict=True))
        return BlockShape(ranges, high[-1], "symmetry" in tagged.facets)
    x, y = (-rubber.length / 2, rubber.length / 2), (0.0, rubber.width / 2)
    slice_ = scene.model == "slice"
    ranges = [x] if slice_ else [x, y]
    return BlockShape(ranges, rubber.height, not slice_, sipe_ranges(scene), rubber.sipe_depth)


def tagged_rubber(scene: Scene) -> TaggedMesh:
    """The rubber on this rank alone. Raises SceneError if the user's mesh can't be used."""
    if scene.rubber.mesh is not None:
        dim = 2 if scene.model == "slice" else 3
        return load_user_mesh(scene.rubber.mesh, dim, scene.rubber.mesh_unit)
    block = block_shape(scene)
    lines = box_lines(block, scene.numerics.refinement)

    def contact(centre: Lines) -> NDArray[np.bool_]:
        z = centre[:, -1]
        low = (z < CONTACT_HEIGHT * block.height) & ~np.isclose(z, block.sipe_depth)
        return (z == 0.0) | (low & (centre[:, -2] != 0.0) if block.symmetric else low)

    def plate(centre: Lines) -> NDArray[np.bool_]:
        return np.isclose(centre[:, -1], block.height)

    def sipes(centre: Lines) -> NDArray[np.bool_]:
        cut = [(low < centre[:, 0]) & (centre[:, 0] < high) for low, high in block.sipes]
        return np.any(cut, axis=0) & (centre[:, -1] < block.sipe_depth)

    parts = {"contact": contact, "plate": plate}
    parameters = [CONTACT_HEIGHT, block.sipes, block.sipe_depth, *(line.tolist() for line in lines)]
    holes = sipes if block.sipes else None
    return cached(
        "rubber", len(lines), parameters, lambda: tensor_grid(lines, "rubber", parts, holes)
    )
