"""The built-in block from its shape: patches of its profile, swept across it, leaned, and named."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.errors import SceneError
from iceslide_fem.mesh.box import EdgeCells, Grid, block_grid
from iceslide_fem.mesh.gmsh_model import TaggedMesh
from iceslide_fem.mesh.grid import Chooser, Lines, snapped, with_parts
from iceslide_fem.mesh.patches import Patch, Point, even, mesh_patches, rectangle
from iceslide_fem.mesh.shape import BlockShape, leaned
from iceslide_fem.mesh.soundness import Soundness, place

CONTACT_HEIGHT = 0.5  # the sides may touch the ice up to this fraction of the height
NEAR = 1e-9  # of the height
# The patches at an arc meet at this distance from its middle, and so many radii from the corner
# lies the middle of an arc, and of a cut at 45 degrees.
MEETING = 0.5
MIDDLE = {False: 1.0 - 0.5**0.5, True: 0.5}


def block_mesh(block: BlockShape, refinement: float) -> TaggedMesh:
    """Mesh of a built-in block, on this rank alone. Raises SceneError if it overlaps itself."""
    grid = block_grid(block, refinement)
    points, cells = mesh_patches(profile_patches(block, grid), grid.y)
    for axis, line in zip((0, -1), (grid.x, grid.z), strict=True):
        points[:, axis] = snapped(points[:, axis], line)
    if grid.y is not None:
        points[:, 1] = snapped(points[:, 1], grid.y)
        cells = cells[~_in_channels(block, points[cells].mean(axis=1))]
    tagged = with_parts(points, cells, "rubber", part_choosers(block))
    if block.straight:
        return tagged
    tagged = tagged._replace(points=leaned(block, tagged.points))
    fault = Soundness(tagged).fault(tagged.facets["plate"])
    if fault is not None:
        raise SceneError(
            f"the rubber's sipes or sides overlap each other near {place(fault[1])}: rubber.sipes "
            "that lean or wave into each other, or rubber.draft_angle, ask for too much"
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


def profile_patches(block: BlockShape, grid: Grid) -> list[Patch]:
    """Patches of the straight block's profile."""
    patches, low_rows = [], len(grid.edge.zone) if grid.edge else 0
    for column, slot in zip(grid.columns, grid.slot, strict=True):
        for number, row in enumerate(grid.rows):
            if slot >= 0 and row[-1] <= block.slots[slot].depth * (1.0 + NEAR):
                continue
            if number < low_rows and _in_a_zone(grid, column):
                continue
            patches.append(rectangle(column, row))
    if grid.edge:
        for corner, way in grid.zones:
            patches += _edge_patches(corner, way, grid.edge, block.cut)
    return patches


def count(block: BlockShape, refinement: float) -> dict[str, float]:
    """Cells, nodes of the quadratic elements, smallest and largest edge of cells along the sides of
    patches (m), of the block without its channels: nothing is meshed.
    """
    grid = block_grid(block, refinement)
    patches = profile_patches(block, grid)
    cells, edges, sides = 0, [], Counter[frozenset[Point]]()
    counts: dict[frozenset[Point], int] = {}
    for patch in patches:
        one, two = (sum(side.cells for side in part) for part in patch[:2])
        cells += one * two
        for side in itertools.chain(*patch):
            key = frozenset(tuple(round(v / block.height, 9) for v in p) for p in side[:2])
            sides[key] += 1  # type: ignore[index]
            counts[key] = side.cells  # type: ignore[index]
            edges.append(np.diff(side.at) * side.length)
    border = sum(counts[key] for key, number in sides.items() if number == 1)
    # Euler: V - E + F = 1 without holes, and every cell has four edges: 2 E = 4 F + border.
    nodes = 1 + 4 * cells + border
    if grid.y is not None:
        edges.append(np.diff(grid.y))
        nodes *= 2 * (len(grid.y) - 1) + 1
        cells *= len(grid.y) - 1
    lengths = np.concatenate(edges)
    return {
        "cells": cells,
        "quadratic_nodes": nodes,
        "smallest_m": float(lengths.min()),
        "largest_m": float(lengths.max()),
    }


def _in_a_zone(grid: Grid, column: Lines) -> bool:
    assert grid.edge is not None
    reach = grid.edge.zone[-1][-1] * (1.0 + NEAR)
    return any(
        max(abs(column[0] - corner), abs(column[-1] - corner)) <= reach
        and way * (column.mean() - corner) > 0.0
        for corner, way in grid.zones
    )


def _in_channels(block: BlockShape, centre: Array) -> Mask:
    """Which cells are cut out along the sliding direction, by their centres (n, 3)."""
    inside = np.zeros(len(centre), dtype=bool)
    for low, high, depth in block.channels:
        inside |= (low < centre[:, 1]) & (centre[:, 1] < high) & (centre[:, 2] < depth)
    return inside


def _edge_patches(x: float, way: int, edge: EdgeCells, cut: bool) -> list[Patch]:
    """The three patches at a cut edge, whose sharp corner would be at (x, 0).

    The cut is one side with the bottom beside it and the wall above it: half of them belong to
    either patch along it; a third patch fills the zone's inner corner. All three meet at a point.
    """
    r, (layer, zone) = edge.radius, (lines[-1] for lines in edge.zone)

    def at(along: float, up: float) -> Point:
        return float(x + way * along), float(up)

    middle = MIDDLE[cut] * r
    meeting = middle + MEETING * r
    centre = None if cut else at(r, r)
    far, bottom, half = at(zone, 0.0), at(r, 0.0), at(middle, middle)
    wall, high, inner = at(0.0, r), at(0.0, zone), at(zone, zone)
    lower, upper, heart = at(zone, layer), at(layer, zone), at(meeting, meeting)
    outwards = even(half, heart, edge.layer)
    down, over = even(heart, lower, edge.along), even(heart, upper, edge.along)
    return [
        (
            [even(far, bottom, edge.arc), even(bottom, half, edge.arc, centre)],
            [outwards],
            [down],
            [even(lower, far, edge.layer)],
        ),
        (
            [even(inner, lower, edge.along)],
            [down.reversed()],
            [over],
            [even(upper, inner, edge.along)],
        ),
        (
            [even(half, wall, edge.arc, centre), even(wall, high, edge.arc)],
            [even(high, upper, edge.layer)],
            [over.reversed()],
            [outwards.reversed()],
        ),
    ]
