"""The built-in block from its shape: patches of its profile, swept across it, leaned, and named."""

from __future__ import annotations

import itertools
from collections import Counter
from typing import NamedTuple

import numpy as np

from iceslide_fem.mesh.box import block_grid
from iceslide_fem.mesh.grid import Chooser, snapped, with_parts
from iceslide_fem.mesh.patches import Patch, Point, mesh_patches
from iceslide_fem.mesh.shape import BlockShape, leaned
from iceslide_fem.mesh.soundness import Soundness, place
from iceslide_fem.mesh.swept import NEAR, edge_patches, profile_patches, swept
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError

CONTACT_HEIGHT = 0.5  # the sides may touch the ice up to this fraction of the height


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
    """Which facets of the straight block, by their corners (n, corners, dim), are which part."""
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
    """Cells, nodes of the quadratic elements, smallest and largest edge of cells along the sides of
    patches (m), of the block without its channels: nothing is meshed.
    """
    grid = block_grid(block, refinement)
    profile = _counted(profile_patches(block, grid), block.height)
    cells, nodes, lengths = profile.cells, profile.nodes, profile.lengths
    if grid.across:
        lengths = np.concatenate([lengths, np.diff(grid.lines[1])])
        along = sum(len(span.middle) - 1 for span in grid.across)
        cells, nodes = cells * along, nodes * (2 * along + 1)
        lugs = [len(span.middle) - 1 for span in grid.columns if not span.depth]
        for corner, way in (end for span in grid.across for end in span.corners):
            bar = _counted(edge_patches(corner, way, grid, block.cut), block.height)
            # less what it shares with the profile: its ends, and the side towards the middle
            side = 2 * len(grid.lines[-1]) - 1
            cells += bar.cells * sum(lugs)
            nodes += sum((bar.nodes - side) * (2 * lug - 1) for lug in lugs)
    return {
        "cells": cells,
        "quadratic_nodes": nodes,
        "smallest_m": float(lengths.min()),
        "largest_m": float(lengths.max()),
    }


class _Counted(NamedTuple):
    """Of patches: cells, nodes of the quadratic elements, and lengths of edges (m)."""

    cells: int
    nodes: int
    lengths: Array


def _counted(patches: list[Patch], height: float) -> _Counted:
    cells, edges, sides = 0, [], Counter[frozenset[Point]]()
    counts: dict[frozenset[Point], int] = {}
    for patch in patches:
        one, two = (sum(side.cells for side in part) for part in patch[:2])
        cells += one * two
        for side in itertools.chain(*patch):
            key = frozenset(tuple(round(v / height, 9) for v in p) for p in side[:2])
            sides[key] += 1  # type: ignore[index]
            counts[key] = side.cells  # type: ignore[index]
            edges.append(np.diff(side.at) * side.length)
    border = sum(counts[key] for key, number in sides.items() if number == 1)
    # Euler: V - E + F = 1 without holes, and every cell has four edges: 2 E = 4 F + border.
    return _Counted(cells, 1 + 4 * cells + border, np.concatenate(edges))
