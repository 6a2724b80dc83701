"""Round edges as they are: cells have straight sides, chords of the arcs."""

from __future__ import annotations

import numpy as np

from iceslide_fem.mesh.box import Span, block_grid
from iceslide_fem.mesh.shape import BlockShape, leaned, straightened
from iceslide_fem.runtime.arrays import Array

NEAR = 1e-9  # of the radius


def on_arcs(block: BlockShape, points: Array) -> Array:
    """Points (..., d), m, on the surface of the block's cells, those on chords of round edges moved
    to the arcs, away from the arcs' axes.
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
    # Where two arcs meet, in a mitre, a point is of the one that it is further out at, or of both.
    out = np.abs(away[:, :-1])
    furthest = out.max(axis=1)
    away[:, :-1][out < (1.0 - NEAR) * furthest[:, None]] = 0.0
    there = (furthest > NEAR * radius) & (away[:, -1] < -NEAR * radius)
    distance = np.hypot(furthest, away[:, -1])[there, None]
    moved = points.reshape(straight.shape).copy()
    moved[there] = leaned(block, straight[there] + away[there] * (radius / distance - 1.0))
    return moved.reshape(points.shape)


def _from_axes(at: Array, spans: list[Span], radius: float) -> Array:
    """Distances (n,) along x or y from the axes of arcs, m, signed; 0 where there is none."""
    away = np.zeros_like(at)
    for corner, way in (end for span in spans for end in span.corners):
        here = at - (corner + way * radius)
        away += np.where((here * way < 0.0) & (np.abs(here) <= (1.0 + NEAR) * radius), here, 0.0)
    return away
