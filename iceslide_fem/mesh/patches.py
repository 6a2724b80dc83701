"""Meshes of four-sided patches, and of what they sweep, built by gmsh.

Patches lie in the plane of x and z; each is a transfinite surface of quadrilaterals, which an
extrusion along y turns into hexahedra. Straight sides with unequal cells are points that gmsh
extrudes in layers.
"""

from __future__ import annotations

from typing import NamedTuple

import gmsh
import numpy as np

from iceslide_fem.mesh.gmsh_model import empty_model
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array

Point = tuple[float, float]
ROUNDING = 1e-9  # of the mesh's size: points nearer than that are one


class Side(NamedTuple):
    """A straight line, or an arc around `centre`, from start to end (x, z), m.

    at (n + 1,): where its n cells end, from 0 to 1.
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
        """The other way round."""
        return Side(self.end, self.start, 1.0 - self.at[::-1], self.centre)

    @property
    def length(self) -> float:
        """Of the chord, m."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))


# Four sides, each of one or more pieces, one after the other around the patch.
Patch = tuple[list[Side], list[Side], list[Side], list[Side]]


def even(start: Point, end: Point, count: int, centre: Point | None = None) -> Side:
    """A side with `count` equal cells."""
    return Side(start, end, np.linspace(0.0, 1.0, count + 1), centre)


def rectangle(x: Array, z: Array) -> Patch:
    """The patch between the lines of x and of z, m."""
    along, up = (x - x[0]) / (x[-1] - x[0]), (z - z[0]) / (z[-1] - z[0])
    corners = [(float(a), float(b)) for a, b in ((x[0], z[0]), (x[-1], z[0]))]
    corners += [(float(a), float(b)) for a, b in ((x[-1], z[-1]), (x[0], z[-1]))]
    one, two, three, four = corners
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
        loops = [plane.loop(patch) for patch in patches]
        geometry = model.geo
        surfaces = [geometry.addPlaneSurface([geometry.addCurveLoop(loop)]) for loop in loops]
        if y is not None:
            width = float(y[-1] - y[0])
            layers = ((y[1:] - y[0]) / width).tolist()
            geometry.extrude(
                [(2, surface) for surface in surfaces],
                0.0,
                width / size,
                0.0,
                [1] * len(layers),
                layers,
                recombine=True,
            )
        geometry.synchronize()
        plane.divide(model)
        corners = _Corners(model)
        for surface, patch in zip(surfaces, patches, strict=True):
            points = [corners.at(side[0].start, size) for side in patch]
            model.mesh.setTransfiniteSurface(surface, cornerTags=points)
            model.mesh.setRecombine(2, surface)
        model.mesh.generate(2 if y is None else 3)
        numbers, coordinates, _ = model.mesh.getNodes()
        _, cells = model.mesh.getElementsByType(3 if y is None else 5)
    points, used = coordinates.reshape(-1, 3) * size, np.asarray(cells)
    order = np.argsort(numbers)
    kept, cells = np.unique(used, return_inverse=True)
    points = points[order[np.searchsorted(numbers, kept, sorter=order)]]
    if y is None:
        points = points[:, ::2]
    else:
        points[:, 1] += y[0]
    return points, cells.reshape(-1, 4 if y is None else 8)


class _Plane:
    """Curves of the current gmsh model in the plane y = 0, each once; lengths are over `size`."""

    def __init__(self, size: float) -> None:
        self._size = size
        self._points: dict[tuple[int, int], int] = {}
        self._curves: dict[tuple[object, ...], int] = {}
        self._counts: dict[int, int] = {}

    def loop(self, patch: Patch) -> list[int]:
        """Curves around a patch, negative where they run the other way."""
        return [self._curve(side) for part in patch for side in part]

    def divide(self, model: gmsh.model) -> None:
        """Give the curves with equal cells their number."""
        for curve, count in self._counts.items():
            model.mesh.setTransfiniteCurve(curve, count + 1)

    def _curve(self, side: Side) -> int:
        start, end = self._key(side.start), self._key(side.end)
        if (start, end) in self._curves:
            return self._curves[start, end]
        if (end, start) in self._curves:
            return -self._curves[end, start]
        geometry = gmsh.model.geo
        equal = bool(np.allclose(side.at * side.cells, np.arange(side.cells + 1.0), atol=1e-9))
        if equal:
            ends = self._point(side.start), self._point(side.end)
            if side.centre is None:
                curve = geometry.addLine(*ends)
            else:
                curve = geometry.addCircleArc(ends[0], self._point(side.centre), ends[1])
            self._counts[curve] = side.cells
        else:
            way = [(b - a) / self._size for a, b in zip(side.start, side.end, strict=True)]
            layers = [1] * side.cells, side.at[1:].tolist()
            made = geometry.extrude([(0, self._point(side.start))], way[0], 0.0, way[1], *layers)
            self._points.setdefault(end, made[0][1])
            curve = made[1][1]
        self._curves[start, end] = curve
        return int(curve)

    def _key(self, point: Point) -> tuple[int, int]:
        scale = 1.0 / (ROUNDING * self._size)
        return round(point[0] * scale), round(point[1] * scale)

    def _point(self, point: Point) -> int:
        key = self._key(point)
        if key not in self._points:
            x, z = (value / self._size for value in point)
            self._points[key] = gmsh.model.geo.addPoint(x, 0.0, z)
        return self._points[key]


class _Corners:
    """Points of the synchronised model, found by where they are."""

    def __init__(self, model: gmsh.model) -> None:
        self._tags = [tag for _, tag in model.getEntities(0)]
        self._at = np.array([model.getValue(0, tag, []) for tag in self._tags])

    def at(self, point: Point, size: float) -> int:
        """The point at (x, 0, z), m."""
        wanted = np.array([point[0] / size, 0.0, point[1] / size])
        return int(self._tags[int(((self._at - wanted) ** 2).sum(axis=1).argmin())])
