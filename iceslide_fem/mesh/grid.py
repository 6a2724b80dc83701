"""Meshes of four-sided patches and of their extrusions, built by gmsh; grids on graded lines.

Patches lie in the x-z plane. Each is a transfinite surface of quadrilaterals; an extrusion along y
makes hexahedra. Straight sides with unequal cells are made by layered extrusion of a point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from iceslide_fem.mesh.gmsh_model import empty_model, nodes_of
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, among, outer_facets
from iceslide_fem.runtime.arrays import Array

Point = tuple[float, float]
SAME_POINT = 1e-9  # of the mesh's size: tolerance of equal points


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
        x, z = (round(value / (SAME_POINT * self._size)) for value in point)
        return x, z

    def _point(self, point: Point) -> int:
        key = self._key(point)
        if key not in self._points:
            x, z = (value / self._size for value in point)
            self._points[key] = gmsh.model.geo.addPoint(x, 0.0, z)
        return self._points[key]


ROUNDING = 1e-10  # of a line's length

Lines = NDArray[np.float64]
Chooser = Callable[[Lines], NDArray[np.bool_]]


def graded(length: float, first: float, slope: float, largest: float = math.inf) -> Lines:
    """Grid lines from 0 to `length` with cells of about s(x) = min(first + slope x, largest).

    The lines are evenly spaced in N(x) = integral of dx / s, the number of cells up to x, after
    N(length) is rounded to a whole number (at least 1). Same units for all but `slope`.
    """
    turn = min(max((largest - first) / slope, 0.0), length)
    cells_to_turn = math.log1p(slope * turn / first) / slope
    cells = cells_to_turn + (length - turn) / min(first + slope * turn, largest)
    number = np.linspace(0.0, cells, max(round(cells), 1) + 1)
    growing = first / slope * np.expm1(slope * np.minimum(number, cells_to_turn))
    lines = (
        growing + np.maximum(number - cells_to_turn, 0.0) * largest if turn < length else growing
    )
    lines[-1] = length
    return lines


def tensor_grid(lines: list[Lines], body: str, parts: Mapping[str, Chooser]) -> TaggedMesh:
    """Tensor-product grid on `lines` of x, (y,) z; `parts` choose outer facets by their centres.

    Centres have the shape (n, dim). In 3-D a side at y = 0 is the part `symmetry`.
    """
    x, *y, z = lines
    points, cells = mesh_patches([rectangle(x, z)], y[0] if y else None)
    for axis, line in enumerate(lines):
        points[:, axis] = snapped(points[:, axis], line)
    if y:
        parts = {**parts, "symmetry": lambda centre: centre[:, 1] == 0.0}

    def by_centre(choose: Chooser) -> Chooser:
        return lambda corners: choose(corners.mean(axis=1))

    return with_parts(points, cells, body, {name: by_centre(parts[name]) for name in parts})


def snapped(values: Lines, line: Lines) -> Lines:
    """Values within rounding of a point of the sorted `line` moved to it; others unchanged."""
    nearest = line[np.searchsorted(0.5 * (line[1:] + line[:-1]), values)]
    return np.where(np.abs(values - nearest) <= ROUNDING * (line[-1] - line[0]), nearest, values)


def with_parts(
    points: Lines, cells: IntArray, body: str, parts: Mapping[str, Chooser]
) -> TaggedMesh:
    """Quadrilaterals or hexahedra whose outer facets are chosen by corners (n, corners, dim).

    Empty parts and unused nodes are dropped.
    """
    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 2 ** points.shape[1])
    kind = "quadrilateral" if points.shape[1] == 2 else "hexahedron"
    whole = TaggedMesh(points, kind, cells, {}, body)
    facets = outer_facets(whole)
    corners = points[facets]
    chosen = {
        name: facets[some] for name, choose in parts.items() if (some := choose(corners)).any()
    }
    return whole._replace(facets=chosen)


def with_sides(tagged: TaggedMesh) -> TaggedMesh:
    """The mesh with its unnamed outer facets as `sides`."""
    free = outer_facets(tagged)
    if tagged.facets:
        free = free[~among(free, np.concatenate(list(tagged.facets.values())))]
    return tagged._replace(facets={**tagged.facets, "sides": free}) if len(free) else tagged
