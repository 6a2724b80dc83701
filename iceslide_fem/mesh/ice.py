"""Mesh of the ice below the block: a patch (attached ice), or a moving window (sliding ice).

Its surface is the plane z = 0; layers get thicker with depth. `..._lines` are the lines of all
nodes. `..._cells` are the lines of quadratic cells, without their mid-nodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.mesh.box import box_lines, from_edge, reference_cells
from iceslide_fem.mesh.grid import Chooser, Lines, tensor_grid, with_sides
from iceslide_fem.mesh.rubber import block_shape
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.scene.materials import Layer
from iceslide_fem.scene.thermal_layers import node_depths, stacked_layers

WINDOW_CELLS = 100  # along the block, where the ice slides
MOST_CELLS = 4  # that the block may pass in a step, with at least one substep per cell
WINDOW_GUARD = 3  # cells before and behind the reach of the block, which includes
WINDOW_SHEAR = 0.15  # of its height: displacement by a change of friction
WINDOW_BULGE = 0.05  # the same sideways; 0.002 in a soft cube (3 bar, -5 degC)
WINDOW_BESIDE = 0.15  # to there one more cell; 0.05 in a cube at 5 bar whose edge folds


def patch_lines(
    scene: Any, footprint: Sequence[tuple[float, float]] | None = None, margin: float = 0.0
) -> list[Lines]:
    """Surface lines (x, and y in a block) of attached ice.

    They are the rubber's lines stretched to the contact, two for each, fewer along x in a block.
    footprint: ranges of x (and y) in contact, m, by default those of the undeformed block; the ice
    exceeds it by `ice.margin`, and at least by `margin` (m), on each side. y begins at 0 below a
    symmetric block.
    """
    block, refinement = block_shape(scene), scene.numerics.refinement
    cells, size = reference_cells(block, refinement)
    margin, widest = max(scene.ice.margin, margin), max(cells[:-1])
    lines = []
    axes = zip(
        box_lines(block, refinement)[:-1], cells[:-1], footprint or block.ranges, strict=True
    )
    for rubber, cell, (low, high) in axes:
        beyond = from_edge(margin, cell, size)[1:] if margin > 0.0 else np.empty(0)
        # Rubber elements are quadratic and ice elements linear, so the ice has a line through their
        # middles, too. It has fewer where they are short only to resolve pressure, because heat
        # spreads along both axes.
        of_rubber = len(rubber) - 1
        of_ice = round(2.0 * of_rubber * math.sqrt(cell / widest))
        places = np.linspace(0.0, of_rubber, of_ice + 1)
        inner = np.interp(places, np.arange(of_rubber + 1), rubber)
        inner = low + (inner - inner[0]) * (high - low) / (inner[-1] - inner[0])
        lines.append(np.concatenate([low - beyond[::-1], inner, high + beyond]))
    if block.symmetric:
        lines[1] = lines[1][lines[1] >= 0.0]
    return lines


def window_cell(scene: Any) -> float:
    """Width (m) of the cells of sliding ice: `ice.cell`, or a fraction of the block's length."""
    (low, high), *_ = block_shape(scene).ranges
    return scene.ice.cell or (high - low) / (WINDOW_CELLS * scene.numerics.refinement)


def cells_in_a_step(scene: Any) -> int:
    """Number of cells of sliding ice that the block may pass in a step; one with moving water."""
    return MOST_CELLS if scene.water_speed == 1.0 else 1


def window_lines(scene: Any, footprint: Sequence[tuple[float, float]]) -> list[Lines]:
    """Surface lines (x, and y in a block) of the window of sliding ice that follows the block.

    Cells are equal in x, so the window shifts by whole cells. They cover the contact and the
    undeformed block, to which it returns when friction falls, with a margin; behind it also
    `ice.trail`. y is as in `patch_lines`, with a margin and one more cell beside it.
    """
    block, cell = block_shape(scene), window_cell(scene)
    low, high = footprint[0]
    guard = WINDOW_GUARD + math.ceil(WINDOW_SHEAR * block.height / cell)
    before = guard + MOST_CELLS + max(0, math.ceil((block.ranges[0][1] - high) / cell))
    behind = guard + max(0, math.ceil((low - block.ranges[0][0]) / cell))
    behind += math.ceil(scene.ice.trail / cell)
    count = math.ceil((high - low) / cell) + behind + before
    x = low - behind * cell + cell * np.arange(count + 1)
    more = (WINDOW_BESIDE - WINDOW_BULGE) * block.height
    across = patch_lines(scene, footprint, WINDOW_BULGE * block.height)[1:]
    return [x, *(_wider(y, more, block.symmetric) for y in across)]


def _wider(line: Lines, more: float, symmetric: bool) -> Lines:
    """A line with one more cell of a width (m) at both ends, of a symmetric block at the last."""
    first = np.empty(0) if symmetric else line[:1] - more
    return np.concatenate([first, line, line[-1:] + more])


def surface_lines(scene: Any, footprint: Sequence[tuple[float, float]]) -> list[Lines]:
    """Lines of x (and y), m, on the surface of the scene's ice, attached or sliding.

    footprint: ranges of x (and y) in contact, m.
    """
    lines = patch_lines if scene.ice.motion == "attached" else window_lines
    return lines(scene, footprint)


def ice_cells(scene: Any, surface: Sequence[Lines], heated: ArrayLike | None = None) -> list[Lines]:
    """Lines in x, (y,) z between the cells of the ice and the layers below it, on this rank.

    surface: lines of x (and y), m; heated: heating times of runs, s, by default those of the scene
    (`heating_times`). Downwards they are the elements of `thermal_layers`, to the depth that heat
    reaches.
    """
    if heated is None:
        heated = heating_times(scene, float(np.ptp(surface[0])), scene.load.duration)
    jumps = scene.ice.held not in (None, scene.ice.temperature)
    thickness = stacked_layers(scene.ice.stack, heated, to_base=jumps).thickness
    return [*surface, -np.append(0.0, np.cumsum(thickness))[::-1]]


def ice_shape(scene: Scene) -> tuple[int, ...]:
    """Number of nodes along x, (y,) z of the scene's built-in ice mesh.

    For sliding ice it is an estimate with the undeformed block; the actual window depends on the
    contact's length.
    """
    footprint = block_shape(scene).ranges
    if scene.ice.heat == "mesh":
        *across, down = ice_cells(scene, surface_lines(scene, footprint))
        return (*(len(line) for line in across), 2 * len(down) - 1)
    sliding = scene.ice.motion == "sliding"
    surface = window_lines(scene, footprint) if sliding else None
    return tuple(len(line) for line in ice_lines(scene, surface))


def ice_lines(scene: Any, surface: Sequence[Lines] | None = None) -> list[Lines]:
    """Grid lines in x, (y,) z of the continuum ice that a run of the scene warms, on this rank.

    surface: grid lines of x (and y) on it, m, by default `patch_lines` of the undeformed block.
    Downwards they are the nodes of `thermal_layers`. Raises SceneError if the user's mesh can't be
    used.
    """
    lines = list(surface or patch_lines(scene))
    heated = heating_times(scene, float(np.ptp(lines[0])), scene.load.duration)
    half_space = [Layer("ice", np.inf, scene.ice.solid)]
    depths = node_depths(stacked_layers(half_space, heated).thickness)
    return [*lines, -depths[::-1]]


def heating_times(scene: Any, length: float, durations: ArrayLike) -> Array:
    """Longest heating (s) of any ice in runs of the `durations` (s).

    length: of the window of sliding ice, m, which limits the time of heating. Each run has its own
    lowest speed, because a continued run must keep the layers of the first one.
    """
    if scene.ice.motion == "attached":
        return np.asarray(durations, dtype=float)
    speeds = scene.load.speeds
    times = [
        passing_time(length, replace(speeds, duration=duration).smallest, duration)
        for duration in np.ravel(durations).tolist()
    ]
    return np.reshape(times, np.shape(durations))


def passing_time(length: float, speed: float, duration: float) -> float:
    """Time (s) in which ice at `speed` (m/s) passes `length` (m), at most `duration` (s)."""
    return length / speed if speed * duration > length else duration


def tagged_ice(lines: list[Lines], stack: Sequence[Layer]) -> TaggedMesh:
    """Ice and the layers below it on grid `lines`, on this rank, with the names of the `stack`.

    Parts: `surface` (z = 0), `base` (lowest facets), `symmetry` (y = 0), and `sides` (the others).
    """
    lowest, next_one = lines[-1][:2]
    parts: dict[str, Chooser] = {
        "surface": lambda centre: centre[:, -1] == 0.0,
        "base": lambda centre: centre[:, -1] < 0.75 * lowest + 0.25 * next_one,
    }
    tagged = with_sides(tensor_grid(lines, stack[0].name, parts))
    ends = -np.cumsum([layer.thickness for layer in stack])
    depths = tagged.points[tagged.cells, -1].mean(axis=1)
    number = np.sum(depths[:, None] < ends[:-1], axis=1)
    regions = {layer.name: np.flatnonzero(number == n) for n, layer in enumerate(stack)}
    return tagged._replace(regions={name: cells for name, cells in regions.items() if cells.size})
