"""Meshes of four-sided patches and of their extrusions, built by gmsh.

Patches lie in the x-z plane. Each is a transfinite surface of quadrilaterals; an extrusion along y
makes hexahedra. Straight sides with unequal cells are made by layered extrusion of a point.
"""

from __future__ import annotations

from typing import NamedTuple

import gmsh
import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.mesh.gmsh_model import empty_model, nodes_of
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array

Point = tuple[float, float]
ROUNDING = 1e-9  # of the mesh's size: tolerance of equal points


class Side(NamedTuple):
    """A straight line, or an arc around `centre`, from start to end (x, z), m.

    at (n + 1,): ends of its n cells, from 0 to 1.
    """

    start: Point
    end: Point
    at: Array
    centre: Point | None = None

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.at) - 1

    def reversed(self) -> Side:
        """The side in the opposite direction."""
        return Side(self.end, self.start, 1.0 - self.at[::-1], self.centre)

    @property
    def length(self) -> float:
        """Of the chord, m."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))


# Four sides around the patch, each of one or more pieces.
Patch = tuple[list[Side], list[Side], list[Side], list[Side]]


def even(start: Point, end: Point, count: int, centre: Point | None = None) -> Side:
    """A side with `count` equal cells."""
    return Side(start, end, np.linspace(0.0, 1.0, count + 1), centre)


def rectangle(x: Array, z: Array) -> Patch:
    """The patch with these lines of x and of z, m."""
    along, up = (x - x[0]) / (x[-1] - x[0]), (z - z[0]) / (z[-1] - z[0])
    left, right, low, high = (float(end) for end in (x[0], x[-1], z[0], z[-1]))
    one, two, three, four = (left, low), (right, low), (right, high), (left, high)
    return (
        [Side(one, two, along)],
        [Side(two, three, up)],
        [Side(four, three, along).reversed()],
        [Side(one, four, up).reversed()],
    )


def mesh_patches(patches: list[Patch], y: Array | None = None) -> tuple[Array, IntArray]:
    """Nodes (n, d), m, and cells (m, corners) of patches that share sides; with `y` in 3-D.

    Corners are numbered as gmsh does.
    """
    ends = np.array([side.start for patch in patches for part in patch for side in part])
    size = float(np.ptp(ends, axis=0).max())
    with empty_model() as model:
        plane = _Plane(size)
        loops = [[plane.curve(side) for part in patch for side in part] for patch in patches]
        surfaces = [model.geo.addPlaneSurface([model.geo.addCurveLoop(loop)]) for loop in loops]
        if y is not None:
            width = float(y[-1] - y[0])
            layers = [1] * (len(y) - 1), ((y[1:] - y[0]) / width).tolist()
            faces = [(2, surface) for surface in surfaces]
            model.geo.extrude(faces, 0.0, width / size, 0.0, *layers, recombine=True)
        model.geo.synchronize()
        tags = [tag for _, tag in model.getEntities(0)]
        at = cKDTree([model.getValue(0, tag, []) for tag in tags])
        for surface, patch in zip(surfaces, patches, strict=True):
            corners = [(x / size, 0.0, z / size) for x, z in (side[0].start for side in patch)]
            found = [tags[place] for place in at.query(corners)[1]]
            model.mesh.setTransfiniteSurface(surface, cornerTags=found)
            model.mesh.setRecombine(2, surface)
        model.mesh.generate(2 if y is None else 3)
        _, used = model.mesh.getElementsByType(3 if y is None else 5)
        points, cells = nodes_of(model, used)
    points *= size
    if y is None:
        return points[:, ::2], cells.reshape(-1, 4)
    points[:, 1] += y[0]
    return points, cells.reshape(-1, 8)


class _Plane:
    """Unique curves of the current gmsh model in the plane y = 0; lengths are over `size`."""

    def __init__(self, size: float) -> None:
        self._size = size
        self._points: dict[tuple[int, int], int] = {}
        self._curves: dict[tuple[object, ...], int] = {}

    def curve(self, side: Side) -> int:
        """The curve of a side; negative for the opposite direction."""
        start, end = self._key(side.start), self._key(side.end)
        if (end, start) in self._curves:
            return -self._curves[end, start]
        if (start, end) not in self._curves:
            self._curves[start, end] = self._added(side)
        return self._curves[start, end]

    def _added(self, side: Side) -> int:
        geometry = gmsh.model.geo
        start = self._point(side.start)
        if not np.allclose(side.at * side.cells, np.arange(side.cells + 1.0), atol=1e-9):
            x, z = np.subtract(side.end, side.start) / self._size
            layers = [1] * side.cells, side.at[1:].tolist()
            (_, point), (_, curve) = geometry.extrude([(0, start)], x, 0.0, z, *layers)
            self._points.setdefault(self._key(side.end), point)
            return int(curve)
        end = self._point(side.end)
        if side.centre is None:
            curve = geometry.addLine(start, end)
        else:
            curve = geometry.addCircleArc(start, self._point(side.centre), end)
        geometry.mesh.setTransfiniteCurve(curve, side.cells + 1)
        return int(curve)

    def _key(self, point: Point) -> tuple[int, int]:
        x, z = (round(value / (ROUNDING * self._size)) for value in point)
        return x, z

    def _point(self, point: Point) -> int:
        key = self._key(point)
        if key not in self._points:
            x, z = (value / self._size for value in point)
            self._points[key] = gmsh.model.geo.addPoint(x, 0.0, z)
        return self._points[key]
