"""The built-in block from its shape: profile patches are swept, leaned and named."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from iceslide_fem.mesh.box import Span, block_grid
from iceslide_fem.mesh.grid import Chooser, Patch, mesh_patches, snapped, with_parts
from iceslide_fem.mesh.shape import BlockShape, leaned, straightened
from iceslide_fem.mesh.soundness import Soundness, place
from iceslide_fem.mesh.swept import NEAR, edge_patches, profile_patches, swept
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError

CONTACT_HEIGHT = 0.5  # the sides may touch the ice up to this fraction of the height
ON_ARC = 1e-9  # of a radius: tolerance of a point on an arc


def block_mesh(block: BlockShape, refinement: float) -> TaggedMesh:
    """Mesh of a built-in block, on this rank alone. Raises SceneError if it overlaps itself."""
    grid = block_grid(block, refinement)
    points, cells = (
        swept(block, grid) if grid.across else mesh_patches(profile_patches(block, grid))
    )
    for axis, line in enumerate(grid.lines):
        points[:, axis] = snapped(points[:, axis], line)
    tagged = with_parts(points, cells, "rubber", part_choosers(block))
    if block.straight:
        return tagged
    tagged = tagged._replace(points=leaned(block, tagged.points))
    fault = Soundness(tagged).fault(tagged.facets["plate"])
    if fault is not None:
        raise SceneError(
            "the rubber's sipes or sides overlap each other, or cells beside them do, near "
            f"{place(fault[1])}: rubber.sipes that lean or wave into each other or across round "
            "edges, or rubber.draft_angle, ask for too much"
        )
    return tagged


def part_choosers(block: BlockShape) -> dict[str, Chooser]:
    """Functions that choose the facets of each part of the straight block by their corners."""
    near = NEAR * block.height

    def contact(corners: Array) -> Mask:
        z = corners[..., -1]
        low = (z.mean(axis=1) < CONTACT_HEIGHT * block.height) & (np.ptp(z, axis=1) > near)
        sides = low & ~symmetry(corners) & ~walls(corners)
        return np.asarray((z.max(axis=1) <= near) | sides)

    def walls(corners: Array) -> Mask:
        z, upright = corners[..., -1].mean(axis=1), np.ptp(corners[..., -1], axis=1) > near
        found = np.zeros(len(corners), dtype=bool)
        for axis, cuts in ((0, block.slots), (1, block.channels)):
            for cut in cuts:
                at = corners[..., axis]
                inside = (cut.low - near <= at.min(axis=1)) & (at.max(axis=1) <= cut.high + near)
                found |= inside & (z < cut.depth)
        return found & upright & ~symmetry(corners)

    def plate(corners: Array) -> Mask:
        return np.asarray(corners[..., -1].min(axis=1) >= block.height - near)

    def symmetry(corners: Array) -> Mask:
        return np.asarray(block.symmetric & (np.abs(corners[..., -2]).max(axis=1) <= near))

    parts: dict[str, Chooser] = {"contact": contact, "plate": plate}
    if block.symmetric:
        parts["symmetry"] = symmetry
    return {**parts, "walls": walls} if block.slots or block.channels else parts


def count(block: BlockShape, refinement: float) -> dict[str, float]:
    """Size of the mesh without meshing: cells, nodes of quadratic elements, and edges, m.

    Edges are the smallest and the largest one along sides of patches. Channels are not counted.
    """
    grid = block_grid(block, refinement)
    cells, nodes, lengths = _counted(profile_patches(block, grid), block.height)
    if grid.across:
        lengths = np.concatenate([lengths, np.diff(grid.lines[1])])
        along = sum(len(span.middle) - 1 for span in grid.across)
        cells, nodes = cells * along, nodes * (2 * along + 1)
        lugs = [len(span.middle) - 1 for span in grid.columns if not span.depth]
        for corner, sign in (end for span in grid.across for end in span.corners):
            more, points, _ = _counted(edge_patches(corner, sign, grid, block.cut), block.height)
            # minus what it shares with the profile: its ends, and its inner side
            side = 2 * len(grid.lines[-1]) - 1
            cells += more * sum(lugs)
            nodes += sum((points - side) * (2 * lug - 1) for lug in lugs)
    return {
        "cells": cells,
        "quadratic_nodes": nodes,
        "smallest_m": float(lengths.min()),
        "largest_m": float(lengths.max()),
    }


def _counted(patches: list[Patch], height: float) -> tuple[int, int, Array]:
    """Cells, nodes of the quadratic elements, and lengths of edges (m) of patches."""
    cells = sum(
        math.prod(sum(side.cells for side in part) for part in patch[:2]) for patch in patches
    )
    sides = [side for patch in patches for part in patch for side in part]
    counts = Counter(
        (side.cells, frozenset((round(x / height, 9), round(z / height, 9)) for x, z in side[:2]))
        for side in sides
    )
    border = sum(number for (number, _), patches_of in counts.items() if patches_of == 1)
    # Euler: V - E + F = 1 without holes, and every cell has four edges: 2 E = 4 F + border.
    lengths = np.concatenate([np.diff(side.at) * side.length for side in sides])
    return cells, 1 + 4 * cells + border, lengths


def on_arcs(block: BlockShape, points: Array) -> Array:
    """Surface points (..., d), m, with those on chords of round edges moved outwards to the
    arcs.
    """
    radius = block.edge
    if radius == 0.0 or block.cut:
        return points
    straight = straightened(block, points.reshape(-1, points.shape[-1]))
    grid = block_grid(block, 1.0)
    away = np.zeros_like(straight)
    away[:, -1] = np.minimum(straight[:, -1] - radius, 0.0)
    for axis, spans in enumerate([grid.columns, grid.across][: straight.shape[1] - 1]):
        away[:, axis] = _from_axes(straight[:, axis], spans, radius)
    # In a mitre of two arcs a point belongs to the one with the larger distance, or to both.
    out = np.abs(away[:, :-1])
    furthest = out.max(axis=1)
    away[:, :-1][out < (1.0 - ON_ARC) * furthest[:, None]] = 0.0
    there = (furthest > ON_ARC * radius) & (away[:, -1] < -ON_ARC * radius)
    distance = np.hypot(furthest, away[:, -1])[there, None]
    moved = points.reshape(straight.shape).copy()
    moved[there] = leaned(block, straight[there] + away[there] * (radius / distance - 1.0))
    return moved.reshape(points.shape)


def _from_axes(at: Array, spans: list[Span], radius: float) -> Array:
    """Signed distances (n,) along x or y from the axes of arcs, m; 0 without an arc."""
    away = np.zeros_like(at)
    for corner, sign in (end for span in spans for end in span.corners):
        here = at - (corner + sign * radius)
        away += np.where((here * sign < 0.0) & (np.abs(here) <= (1.0 + ON_ARC) * radius), here, 0.0)
    return away
