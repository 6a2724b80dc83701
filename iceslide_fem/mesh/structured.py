"""Structured meshes of the rubber block and of the ice below it.

Coordinates are (x, z) in a slice and (x, y, z) in a block, in m; z is vertical and the ice
plane is z = 0. The rubber moves in +x, so its leading edge is x = +length/2. A block is the
half with y >= 0 of one that is symmetric about y = 0.

Cells are quadrilaterals or hexahedra on a grid whose lines gather at the contact edges, at the
bottom of the rubber and at the surface of the ice. `numerics.refinement` divides every cell
size by the same number, so meshes of different refinement are similar.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.materials import ICE_DIFFUSIVITY
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.cache import cached
from iceslide_fem.mesh.gmsh_model import TaggedMesh
from iceslide_fem.mesh.grid import Lines, graded, tensor_grid
from iceslide_fem.mesh.user_mesh import load_user_mesh, mesh_size
from iceslide_fem.scene import Scene

# Rubber. The reference cell is the height (or the lateral size, if smaller) over CELLS. A block
# whose height is less than FLAT of its length takes fewer, by the square root, because away from
# its edges the strain hardly varies over the height. Sizes are in reference cells; a slope of 4
# makes cells 1 + 4 times larger one height (or lateral size) away from the edge or the bottom.
CELLS = {2: 16.0, 3: 6.0}  # by dimension
FLAT, FEWEST_CELLS = 0.5, 2.0
EDGE_CELL, EDGE_SLOPE = 0.42, 4.0
LARGEST_CELL = 4.0
CONTACT_HEIGHT = 0.5  # the sides may touch the ice up to this fraction of the height

# Ice
SURFACE_LAYER = 4e-6  # m, thickness of the first layer
LAYER_RATIO = 1.12  # of neighbouring layers
WINDOW_CELLS = 100  # along the block, where the ice slides
WINDOW_GUARD = 3  # cells before and behind what the block may touch, and
WINDOW_SHEAR = 0.15  # of its height, by which a change of friction may move it
DEPTH = 5.0  # in thermal lengths sqrt(alpha t): 4e-4 of the surface's temperature rise is left


class RubberMesh(NamedTuple):
    """DOLFINx mesh and facet tags of the rubber; tags: contact, plate, symmetry -> number."""

    mesh: Any
    facet_tags: Any
    tags: dict[str, int]


class IceMesh(NamedTuple):
    """DOLFINx mesh and facet tags of the ice; tags: surface, symmetry -> number.

    x, y, z are the sorted coordinates of the grid lines (y is empty in a slice), so a point's
    cell is found by `np.searchsorted`.
    """

    mesh: Any
    facet_tags: Any
    tags: dict[str, int]
    x: Lines
    y: Lines
    z: Lines


def rubber_mesh(scene: Scene, comm: MPI.Comm) -> RubberMesh:
    """Mesh of the scene's rubber block, or the user's own if `rubber.mesh` names one.

    Collective. Raises SceneError if the user's mesh can't be used.
    """
    tagged = gmsh_model.from_root(lambda: _rubber(scene), comm)
    return RubberMesh(*gmsh_model.distribute(tagged, comm))


def ice_mesh(
    scene: Any,
    comm: MPI.Comm,
    surface: Sequence[Lines] | None = None,
    depth: float | None = None,
) -> IceMesh:
    """Mesh of the ice that a run of the scene warms.

    surface: grid lines of x (and y) on it, m, by default `patch_lines` of the undeformed block;
    no heat passes the sides. depth (m) is 5 thermal lengths sqrt(alpha t) by default. Collective.
    Raises SceneError if the user's mesh can't be used.
    """

    def build() -> tuple[list[Lines], TaggedMesh]:
        lines = _ice_lines(scene, surface, depth)
        return lines, _ice(lines)

    lines, tagged = gmsh_model.from_root(build, comm)
    y = lines[1] if len(lines) == 3 else np.empty(0)
    return IceMesh(*gmsh_model.distribute(tagged, comm), lines[0], y, lines[-1])


def patch_lines(scene: Any, footprint: Sequence[tuple[float, float]] | None = None) -> list[Lines]:
    """Surface lines (x, and y in a block) of attached ice: the rubber's, stretched to the contact.

    footprint: ranges of x (and y) in contact, m, by default those of the undeformed block; the
    ice exceeds it by `ice.margin` on each side. y begins at 0 below a symmetric block.
    """
    block, refinement = _block(scene), scene.numerics.refinement
    cell, size = _reference_cell(block, refinement)
    margin = scene.ice.margin
    beyond = _from_edge(margin, cell, size)[1:] if margin > 0.0 else np.empty(0)
    lines = []
    *below, _ = _rubber_lines(block, refinement)
    for rubber, (low, high) in zip(below, footprint or block.ranges, strict=True):
        # The rubber's elements are quadratic, the ice's linear: a line through their middles, too.
        inner = np.interp(np.arange(0.0, len(rubber) - 0.5, 0.5), np.arange(len(rubber)), rubber)
        inner = low + (inner - inner[0]) * (high - low) / (inner[-1] - inner[0])
        lines.append(np.concatenate([low - beyond[::-1], inner, high + beyond]))
    if block.symmetric:
        lines[1] = lines[1][lines[1] >= 0.0]
    return lines


def window_cell(scene: Any) -> float:
    """Width (m) of the cells of sliding ice: `ice.cell`, or a share of the block's length."""
    (low, high), *_ = _block(scene).ranges
    return scene.ice.cell or (high - low) / (WINDOW_CELLS * scene.numerics.refinement)


def window_lines(scene: Any, footprint: Sequence[tuple[float, float]]) -> list[Lines]:
    """Surface lines (x, and y in a block) of the window of sliding ice that follows the block.

    Equal cells in x, so that the content can be shifted by whole cells: below the contact and
    below the undeformed block, to which it returns where friction falls, and some more for what
    moves it further; behind it also over `ice.trail`. y as in `patch_lines`.
    """
    block, cell = _block(scene), window_cell(scene)
    low, high = footprint[0]
    guard = WINDOW_GUARD + math.ceil(WINDOW_SHEAR * block.height / cell)
    before = guard + max(0, math.ceil((block.ranges[0][1] - high) / cell))
    behind = guard + max(0, math.ceil((low - block.ranges[0][0]) / cell))
    behind += math.ceil(scene.ice.trail / cell)
    count = math.ceil((high - low) / cell) + behind + before
    x = low - behind * cell + cell * np.arange(count + 1)
    return [x, *patch_lines(scene, footprint)[1:]]


def divisions(scene: Scene) -> dict[str, float]:
    """Size of the rubber's mesh: cells nx, ny (block only), nz of the built-in grid; cells;
    nodes of the quadratic elements; smallest and largest cell edge in m.
    """
    if scene.rubber.mesh is not None or scene.rubber.sipes:
        return mesh_size(_rubber(scene))
    lines = _rubber_lines(_block(scene), scene.numerics.refinement)
    counts = [len(line) - 1 for line in lines]
    names = ["nx", "nz"] if len(lines) == 2 else ["nx", "ny", "nz"]
    edges = np.concatenate([np.diff(line) for line in lines])
    return dict(zip(names, counts, strict=True)) | {
        "cells": math.prod(counts),
        "quadratic_nodes": math.prod(2 * n + 1 for n in counts),
        "smallest_m": float(edges.min()),
        "largest_m": float(edges.max()),
    }


def ice_nodes(scene: Scene) -> int:
    """Number of nodes, and so of temperature unknowns, of the scene's ice mesh.

    Of a window of sliding ice as long as the undeformed block; the contact's length decides.
    """
    sliding = scene.ice.motion == "sliding"
    surface = window_lines(scene, _block(scene).ranges) if sliding else None
    return math.prod(len(line) for line in _ice_lines(scene, surface))


def block_size(scene: Scene) -> tuple[float, ...]:
    """Length, (in 3-D) width, and height of the rubber block in m, of a user's mesh as it is."""
    block = _block(scene)
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2.0
    return (*lengths, block.height)


def sipe_ranges(scene: Scene) -> list[tuple[float, float]]:
    """Ranges of x of the box's sipes, m: evenly spaced."""
    rubber = scene.rubber
    cuts = np.linspace(-rubber.length / 2, rubber.length / 2, rubber.sipes + 2)[1:-1]
    half = rubber.sipe_width / 2
    return [(cut - half, cut + half) for cut in cuts.tolist()]


def write_mesh(scene: Scene, folder: Path | str) -> list[Path]:
    """Write the scene's rubber and ice meshes as gmsh files to `folder`; returns their paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    meshes = {"rubber": _rubber(scene), "ice": _ice(_ice_lines(scene))}
    paths = []
    for kind, tagged in meshes.items():
        paths.append(folder / f"{scene.name}_{kind}.msh")
        gmsh_model.save(tagged, paths[-1])
    return paths


class BlockShape(NamedTuple):
    """Ranges of x and (in 3-D) y that the rubber covers, and its height, in m.

    If it is `symmetric`, y begins at 0 and the other half is left out. sipes: ranges of x of the
    slots of `sipe_depth` (m) that are cut across it from below.
    """

    ranges: list[tuple[float, float]]
    height: float
    symmetric: bool
    sipes: list[tuple[float, float]] = []  # noqa: RUF012 (never changed)
    sipe_depth: float = 0.0


def _block(scene: Scene) -> BlockShape:
    rubber = scene.rubber
    if rubber.mesh is not None:
        tagged = _rubber(scene)
        low, high = tagged.points.min(axis=0), tagged.points.max(axis=0)
        ranges = list(zip(low[:-1], high[:-1], strict=True))
        return BlockShape(ranges, high[-1], "symmetry" in tagged.facets)
    x, y = (-rubber.length / 2, rubber.length / 2), (0.0, rubber.width / 2)
    slice_ = scene.model == "slice"
    ranges = [x] if slice_ else [x, y]
    return BlockShape(ranges, rubber.height, not slice_, sipe_ranges(scene), rubber.sipe_depth)


def _rubber(scene: Scene) -> TaggedMesh:
    if scene.rubber.mesh is not None:
        dim = 2 if scene.model == "slice" else 3
        return load_user_mesh(scene.rubber.mesh, dim, scene.rubber.mesh_unit)
    block = _block(scene)
    lines = _rubber_lines(block, scene.numerics.refinement)

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


def _ice(lines: list[Lines]) -> TaggedMesh:
    parts = {"surface": lambda centre: centre[:, -1] == 0.0}
    parameters = [line.tolist() for line in lines]
    return cached("ice", len(lines), parameters, lambda: tensor_grid(lines, "ice", parts))


def _reference_cell(block: BlockShape, refinement: float) -> tuple[float, float]:
    """Reference cell and the length that the slopes refer to, both in m."""
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2
    lateral = min(lengths)
    cells = CELLS[len(block.ranges) + 1] * math.sqrt(min(1.0, block.height / (FLAT * lateral)))
    size = min(lateral, block.height)
    return size / (max(cells, FEWEST_CELLS) * refinement), size


def _from_edge(length: float, cell: float, size: float) -> Lines:
    """Grid lines at the distances 0 ... `length` from a contact edge."""
    slope = EDGE_SLOPE * EDGE_CELL * cell / size
    return graded(length, EDGE_CELL * cell, slope, LARGEST_CELL * cell)


def _rubber_lines(block: BlockShape, refinement: float) -> list[Lines]:
    """Grid lines of the rubber in x, (y,) z."""
    cell, size = _reference_cell(block, refinement)

    def between(low: float, high: float) -> Lines:
        half = _from_edge((high - low) / 2, cell, size)
        return np.concatenate([low + half, high - half[-2::-1]])

    (first, last), *rest = block.ranges
    cuts = np.array([first, *(end for sipe in block.sipes for end in sipe), last])
    x = [between(low, high) for low, high in itertools.pairwise(cuts)]
    lines = [np.concatenate([x[0], *(line[1:] for line in x[1:])])]
    for low, high in rest:
        half_model = high - _from_edge(high, cell, size)[::-1]
        lines.append(half_model if block.symmetric else between(low, high))
    # The corners at the plate, and at the end of a sipe, are as singular as those at the ice.
    depth = block.sipe_depth if block.sipes else 0.0
    z = between(depth, block.height)
    return [*lines, np.concatenate([between(0.0, depth)[:-1], z]) if block.sipes else z]


def _ice_lines(
    scene: Any, surface: Sequence[Lines] | None = None, depth: float | None = None
) -> list[Lines]:
    """Grid lines of the ice in x, (y,) z."""
    thermal = math.sqrt(ICE_DIFFUSIVITY * scene.load.duration)
    slope = math.log(LAYER_RATIO) / scene.numerics.refinement
    # so that graded starts with the surface's layer
    first = SURFACE_LAYER / scene.numerics.refinement * slope / math.expm1(slope)
    layers = graded(DEPTH * thermal if depth is None else depth, first, slope)
    return [*(surface or patch_lines(scene)), -layers[::-1]]
