"""The heated surface of a conducting body, and points anywhere on it, on any rank.

A point reads the temperature of its facet by the facet's shape functions, and gives its heat to the
facet's nodes with the same weights. All heat that leaves the interface enters the body. The rank of
a point's facet is found from bounding boxes of the ranks' parts; no rank holds the whole surface.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import basix
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.ranks import answered
from iceslide_fem.runtime.arrays import Array, Index

NEAREST = 4  # number of candidate facets of a point: those with the nearest boxes
ENTRIES = 1_000_000  # distances computed at a time
PASSES = 8  # Newton iterations for a position in a facet that is not a parallelogram
SAME = 1e-9  # of a box: tolerance of equal distances


class Reading(NamedTuple):
    """Interpolation to points: global numbers of unknowns and weights (sum 1).

    Both are (n, nodes of a facet).
    """

    number: NDArray[np.int64]
    weight: Array


class HeatedSurface:
    """This rank's facets of a named plane surface of `equation`'s body.

    numbers: global numbers of the unknowns of each facet, (f, a).
    """

    def __init__(self, equation: HeatEquation, name: str) -> None:
        """The facets `name`, in a plane normal to the last axis. Collective."""
        body, self._comm = equation.body, equation.comm
        mesh, dim = body.mesh, body.mesh.geometry.dim
        facets = body.facet_tags.find(body.tags[name])
        cells, self._local = compat.facet_cell_pairs(mesh, facets)
        cell = compat.cell_name(mesh)
        elements = equation.elements
        self._element = compat.basix_lagrange(cell, elements.surface_degree)
        self._closures = np.array(self._element.entity_closure_dofs[dim - 1], dtype=np.intp)
        kind = getattr(basix.CellType, cell)
        self._reference = np.asarray(basix.geometry(kind))
        self._vertices = np.array(basix.topology(kind)[dim - 1], dtype=np.intp)
        dofs = compat.cell_dofs(elements.space)[cells]  # the vertices are first
        self.numbers = equation.numbers[np.take_along_axis(dofs, self._closures[self._local], 1)]
        x = elements.space.tabulate_dof_coordinates()[:, : dim - 1]
        corners = np.take_along_axis(dofs, self._vertices[self._local], 1)
        self._corners = x[corners].reshape(len(cells), self._vertices.shape[1], dim - 1)
        self._low, self._high = self._corners.min(axis=1), self._corners.max(axis=1)
        ends = self._low.min(axis=0, initial=np.inf), self._high.max(axis=0, initial=-np.inf)
        self._boxes = np.array(self._comm.allgather(ends))
        some = self._boxes[np.isfinite(self._boxes).all(axis=(1, 2))]
        self._size = float(np.ptp(some, axis=(0, 1)).max())

    def read(self, points: Array) -> Reading:
        """Interpolation to this rank's `points` (n, axes), m; points outside read the edge.
        Collective.
        """
        comm = self._comm
        away = _distance(points, self._boxes[:, 0], self._boxes[:, 1])
        near = away <= away.min(axis=1, keepdims=True) + SAME * self._size
        wanted = [np.flatnonzero(near[:, rank]) for rank in range(comm.size)]
        outside = np.full(len(points), np.inf)
        shape = len(points), self._closures.shape[1]
        number, weight = np.zeros(shape, dtype=np.int64), np.zeros(shape)
        found = outside, number, weight
        for index, answer in answered(points, wanted, self._here, comm):
            nearer = answer[0] < outside[index]
            for all_of_them, one in zip(found, answer, strict=True):
                all_of_them[index[nearer]] = one[nearer]
        return Reading(number, weight)

    def _here(self, points: Array) -> tuple[Array, NDArray[np.int64], Array]:
        """Distance (m) of points (n, axes) from this rank's nearest facet, and the reading of
        it.
        """
        n, nodes = len(points), self._closures.shape[1]
        if not n or not len(self._corners):
            return np.full(n, np.inf), np.zeros((n, nodes), dtype=np.int64), np.zeros((n, nodes))
        facets = self._nearest(points)
        places = _places(np.repeat(points, facets.shape[1], axis=0), self._corners[facets.ravel()])
        inside = np.clip(places, 0.0, 1.0)
        shape = _bilinear(inside)
        there = np.einsum("nc,nca->na", shape, self._corners[facets.ravel()])
        away = np.linalg.norm(there.reshape(*facets.shape, -1) - points[:, None], axis=2)
        best = away.argmin(axis=1)
        rows = np.arange(n)
        facet, place = facets[rows, best], inside.reshape(*facets.shape, -1)[rows, best]
        weight = np.zeros((n, nodes))
        for local in np.unique(self._local[facet]):
            some = np.flatnonzero(self._local[facet] == local)
            within = _bilinear(place[some]) @ self._reference[self._vertices[local]]
            table = np.array(self._element.tabulate(0, within))[0, :, :, 0]
            weight[some] = table[:, self._closures[local]]
        return away[rows, best], self.numbers[facet], weight

    def _nearest(self, points: Array) -> Index:
        """Facets (n, few) with the nearest boxes to points (n, axes)."""
        few, chunk = min(NEAREST, len(self._corners)), max(ENTRIES // len(self._corners), 1)
        middles = 0.5 * (self._low + self._high)
        parts = []
        for start in range(0, len(points), chunk):
            some = points[start : start + chunk]
            away = _distance(some, self._low, self._high)
            away += SAME * np.abs(some[:, None] - middles).sum(axis=2)
            parts.append(np.argpartition(away, few - 1, axis=1)[:, :few])
        return np.concatenate(parts)


def _distance(points: Array, low: Array, high: Array) -> Array:
    """Distances (n, m), m, of points (n, axes) to boxes (m, axes)."""
    outside = np.maximum(np.maximum(low - points[:, None], points[:, None] - high), 0.0)
    return np.asarray(outside.max(axis=2))


def _bilinear(places: Array) -> Array:
    """Shape functions (n, corners) of an edge or a quadrilateral at places (n, 1 or 2)."""
    first = np.stack([1.0 - places[:, 0], places[:, 0]], axis=1)
    if places.shape[1] == 1:
        return first
    second = np.stack([1.0 - places[:, 1], places[:, 1]], axis=1)
    return np.asarray((second[:, :, None] * first[:, None, :]).reshape(len(places), 4))


def _places(points: Array, corners: Array) -> Array:
    """Places (n, axes) of points (n, axes) in facets with these corners (n, c, axes)."""
    if points.shape[1] == 1:
        length = corners[:, 1] - corners[:, 0]
        return np.asarray((points - corners[:, 0]) / length)
    places = np.full_like(points, 0.5)
    origin = corners[:, 0]
    first, second = corners[:, 1] - origin, corners[:, 2] - origin
    twist = corners[:, 3] - corners[:, 2] - first
    for _ in range(PASSES):
        s, t = places[:, :1], places[:, 1:]
        missing = points - (origin + s * first + t * second + s * t * twist)
        slopes = np.stack([first + t * twist, second + s * twist], axis=2)
        change = np.linalg.solve(slopes, missing[..., None])[..., 0]
        places = places + change
        if np.abs(change).max(initial=0.0) < SAME:
            break
    return places
