"""The heated surface of a conducting body, and points anywhere on it, on any rank.

A point reads the temperature of its facet by the facet's shape functions, and gives its heat to the
facet's nodes with the same weights. All heat that leaves the interface enters the body. The rank of
a point's facet is found from bounding boxes of the ranks' parts; no rank holds the whole surface.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import PETSc, basix
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.exchange import answered
from iceslide_fem.runtime.arrays import Array, Index


class Readings:
    """Interpolation matrix P of this rank's points: temperatures P w, heat P^T q.

    For two bodies, the rows of the first are followed by those of the second.
    """

    def __init__(self, matrix: PETSc.Mat, bodies: int = 1) -> None:
        """Readings by a `matrix` from this number of `bodies`. Collective."""
        self._matrix, self._bodies = matrix, bodies
        self._unknowns, self._points = matrix.createVecs()
        number, weight = _padded(*matrix.getValuesCSR())
        numbers, place = np.unique(number, return_inverse=True)
        place = place.reshape(number.shape)
        # pairs of coupled readings: of a point with itself, and across its film
        pairs = []
        for body in range(bodies):
            other = np.roll(np.arange(len(number)), body * (len(number) // 2))
            product = weight[:, :, None] * weight[other][:, None]
            entry = place[:, :, None] * numbers.size + place[other][:, None]
            there = np.nonzero(product)
            pairs.append((product[there], entry[there], body * len(number) + there[0]))
        product, entry, slope = (np.concatenate(one) for one in zip(*pairs, strict=True))
        entries, entry = np.unique(entry, return_inverse=True)
        shape = entries.size, bodies * len(number)
        self._couples = csr_matrix((product, (entry, slope)), shape=shape)
        rows, columns = np.divmod(entries, max(numbers.size, 1))
        rows, counts = np.unique(rows, return_counts=True)
        self._rows, self._columns = (numbers[one].astype(PETSc.IntType) for one in (rows, columns))
        self._starts = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
        self._some: Index | slice = slice(None)

    def among(self, points: Index) -> Readings:
        """The same for some of the points only, by number."""
        some = copy(self)
        some._some = points
        return some

    def of(self, values: Array) -> Array:
        """Values (n,) of this rank's points. Collective."""
        self._unknowns.array[:] = values
        self._matrix.mult(self._unknowns, self._points)
        return np.array(self._points.array[self._some])

    def given(self, values: Array) -> Array:
        """Sums at the unknowns of the points' `values` (n,). Collective."""
        self._points.array[:] = 0.0
        self._points.array[self._some] = values
        self._matrix.multTranspose(self._points, self._unknowns)
        return np.array(self._unknowns.array)

    def couple(self, matrix: PETSc.Mat, slopes: Array) -> None:
        """Add P^T S P to a matrix with these entries. Collective.

        slopes: of the heat of each point with its temperature, and with that of the other body, if
        there are two, (bodies, n).
        """
        of_all = np.zeros((self._bodies, self._points.getLocalSize()))
        of_all[:, self._some] = slopes
        values = self._couples @ of_all.ravel()
        matrix.setValuesIJV(self._starts, self._columns, values, addv=True, rowmap=self._rows)
        matrix.assemble()

    def widened(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """The matrix with additional entries where films couple unknowns. Collective."""
        first, last = self._matrix.getOwnershipRange()
        size, n = (last - first, PETSc.DETERMINE), last - first
        columns = np.stack([np.roll(np.arange(n), k * n // 2) for k in range(self._bodies)], axis=1)
        starts = self._bodies * np.arange(n + 1)
        csr = starts.astype(PETSc.IntType), (first + columns.ravel()).astype(PETSc.IntType)
        between = PETSc.Mat().createAIJ(
            (size, size), csr=(*csr, np.ones(columns.size)), comm=self._matrix.comm
        )
        weighed = between.matMult(self._matrix)
        falls = self._matrix.transposeMatMult(weighed)
        falls.zeroEntries()
        wide = matrix.copy()
        wide.axpy(1.0, falls, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        for one in (between, weighed, falls):
            one.destroy()
        return wide


def _padded(starts: Array, columns: Array, weights: Array) -> tuple[Array, Array]:
    """Columns and weights of rows of varying length, padded to arrays (rows, longest)."""
    counts = np.diff(starts)
    there = np.arange(counts.max(initial=0)) < counts[:, None]
    number, weight = np.zeros(there.shape, dtype=columns.dtype), np.zeros(there.shape)
    number[there], weight[there] = columns, weights
    return number, weight


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
