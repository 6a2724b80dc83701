"""Mesh of the ice below the block: a patch that stays below it, or a window that follows it.

Its surface is the plane z = 0; layers get thicker with the depth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from iceslide_fem.materials import ICE
from iceslide_fem.mesh.box import box_lines, from_edge, reference_cells
from iceslide_fem.mesh.gmsh_model import TaggedMesh
from iceslide_fem.mesh.grid import Lines, graded, tensor_grid
from iceslide_fem.mesh.rubber import block_shape
from iceslide_fem.scene import Scene

# The first layer is this share of the thermal layer sqrt(alpha t) of the time that ice is rubbed,
# though no longer than LATEST: melting begins within that, however long the run is. It and the
# growth of the layers hold at the tolerance REFERENCE, and follow the root of another one: the
# error of linear elements is of second order (docs/accuracy.md).
FIRST_LAYER, LAYER_RATIO = 0.045, 1.12
LATEST = 7e-3  # s
REFERENCE = 1e-3
COARSEST, FINEST = 2.0, 0.3  # of layers, relative to those at REFERENCE
WINDOW_CELLS = 100  # along the block, where the ice slides
MOST_CELLS = 4  # that the block may pass in a step, film and heat in one sub-step each
WINDOW_GUARD = 3  # cells before and behind what the block may touch, and
WINDOW_SHEAR = 0.15  # of its height, by which a change of friction may move it
WINDOW_BULGE = 0.05  # the same sideways: 0.002 where a soft cube's friction rises (3 bar, -5 degC)
DEPTH = 5.0  # in thermal lengths sqrt(alpha t): 4e-4 of the surface's temperature rise is left


def patch_lines(
    scene: Any, footprint: Sequence[tuple[float, float]] | None = None, margin: float = 0.0
) -> list[Lines]:
    """Surface lines (x, and y in a block) of attached ice: the rubber's, stretched to the contact.

    footprint: ranges of x (and y) in contact, m, by default those of the undeformed block; the
    ice exceeds it by `ice.margin`, and at least by `margin` (m), on each side. y begins at 0 below
    a symmetric block.
    """
    block, refinement = block_shape(scene), scene.numerics.refinement
    cells, size = reference_cells(block, refinement)
    margin = max(scene.ice.margin, margin)
    lines = []
    axes = zip(
        box_lines(block, refinement)[:-1], cells[:-1], footprint or block.ranges, strict=True
    )
    for rubber, cell, (low, high) in axes:
        beyond = from_edge(margin, cell, size)[1:] if margin > 0.0 else np.empty(0)
        # The rubber's elements are quadratic, the ice's linear: a line through their middles, too.
        inner = np.interp(np.arange(0.0, len(rubber) - 0.5, 0.5), np.arange(len(rubber)), rubber)
        inner = low + (inner - inner[0]) * (high - low) / (inner[-1] - inner[0])
        lines.append(np.concatenate([low - beyond[::-1], inner, high + beyond]))
    if block.symmetric:
        lines[1] = lines[1][lines[1] >= 0.0]
    return lines


def window_cell(scene: Any) -> float:
    """Width (m) of the cells of sliding ice: `ice.cell`, or a share of the block's length."""
    (low, high), *_ = block_shape(scene).ranges
    return scene.ice.cell or (high - low) / (WINDOW_CELLS * scene.numerics.refinement)


def cells_in_a_step(scene: Any) -> int:
    """How many cells of sliding ice the block may pass in a step: water that lags goes on after."""
    return MOST_CELLS if scene.film.water_speed == 1.0 else 1


def window_lines(scene: Any, footprint: Sequence[tuple[float, float]]) -> list[Lines]:
    """Surface lines (x, and y in a block) of the window of sliding ice that follows the block.

    Equal cells in x, so that the content can be shifted by whole cells: below the contact and
    below the undeformed block, to which it returns where friction falls, and some more for what
    moves it further; behind it also over `ice.trail`. y as in `patch_lines`, and some more.
    """
    block, cell = block_shape(scene), window_cell(scene)
    low, high = footprint[0]
    guard = WINDOW_GUARD + math.ceil(WINDOW_SHEAR * block.height / cell)
    before = guard + MOST_CELLS + max(0, math.ceil((block.ranges[0][1] - high) / cell))
    behind = guard + max(0, math.ceil((low - block.ranges[0][0]) / cell))
    behind += math.ceil(scene.ice.trail / cell)
    count = math.ceil((high - low) / cell) + behind + before
    x = low - behind * cell + cell * np.arange(count + 1)
    return [x, *patch_lines(scene, footprint, WINDOW_BULGE * block.height)[1:]]


def ice_shape(scene: Scene) -> tuple[int, ...]:
    """Number of nodes along x, (y,) z of the scene's ice mesh.

    Of a window of sliding ice as long as the undeformed block; the contact's length decides.
    """
    sliding = scene.ice.motion == "sliding"
    surface = window_lines(scene, block_shape(scene).ranges) if sliding else None
    return tuple(len(line) for line in ice_lines(scene, surface))


def ice_lines(
    scene: Any,
    surface: Sequence[Lines] | None = None,
    depth: float | None = None,
    layers_for: float | None = None,
) -> list[Lines]:
    """Grid lines in x, (y,) z of the ice that a run of the scene warms, on this rank alone.

    surface: grid lines of x (and y) on it, m, by default `patch_lines` of the undeformed block;
    no heat passes the sides. depth (m) is 5 thermal lengths sqrt(alpha t) by default. layers_for
    (s): it has the layers of a run of that duration, and more below them; by default the scene's.
    Raises SceneError if the user's mesh can't be used.
    """
    lines, duration = list(surface or patch_lines(scene)), layers_for or scene.load.duration
    below, (low, high) = float(np.ptp(lines[0])), block_shape(scene).ranges[0]
    thermal = thermal_layer(scene, high - low, duration)
    first, ratio = surface_layers(thermal, scene.numerics, scene.ice.solid.diffusivity)
    slope = math.log(ratio)
    meshed = depth or DEPTH * thermal_layer(scene, below, duration, longest=True)
    # so that graded starts with the surface's layer
    layers = graded(meshed, first * slope / math.expm1(slope), slope)
    if depth is None:
        layers = deeper(layers, DEPTH * thermal_layer(scene, below, longest=True), ratio)
    return [*lines, -layers[::-1]]


def deeper(layers: Lines, depth: float, ratio: float) -> Lines:
    """`layers` (m, from 0 downwards) and below them more, each by `ratio` thicker, to `depth`."""
    thickness = layers[-1] - layers[-2]
    missing = math.log1p((depth - layers[-1]) / thickness * (ratio - 1.0) / ratio)
    count = math.ceil(round(missing / math.log(ratio), 6))
    return np.append(layers, layers[-1] + np.cumsum(thickness * ratio ** np.arange(1, count + 1)))


def passing_time(scene: Any, length: float, longest: bool = False) -> float:
    """Time (s) in which ice that slides passes `length` (m), no more than the run's.

    At the mean speed, or the `longest` that it may take.
    """
    speeds, duration = scene.load.speeds, float(scene.load.duration)
    speed = speeds.smallest if longest else speeds.mean
    return min(duration, length / speed) if speed * duration > length else duration


def thermal_layer(
    scene: Any, length: float, duration: float | None = None, longest: bool = False
) -> float:
    """sqrt(alpha t) of the run or of the time in which ice that slides passes `length` (m), m.

    duration (s): of the run, by default the scene's; longest: as for `passing_time`.
    """
    time = duration or scene.load.duration
    if scene.ice.motion == "sliding":
        time = min(time, passing_time(scene, length, longest))
    return math.sqrt(scene.ice.solid.diffusivity * time)


def surface_layers(
    thermal: float, numerics: Any, diffusivity: float = ICE.diffusivity
) -> tuple[float, float]:
    """First layer (m) and ratio of neighbouring layers below ice with that `thermal` layer (m).

    `diffusivity` is that of the ice, m2/s.
    """
    size = min(max((numerics.tolerance / REFERENCE) ** 0.5, FINEST), COARSEST) / numerics.refinement
    first = FIRST_LAYER * min(thermal, math.sqrt(diffusivity * LATEST))
    return size * first, LAYER_RATIO**size


def tagged_ice(lines: list[Lines]) -> TaggedMesh:
    """The ice on grid `lines`, on this rank alone."""
    return tensor_grid(lines, "ice", {"surface": lambda centre: centre[:, -1] == 0.0})
