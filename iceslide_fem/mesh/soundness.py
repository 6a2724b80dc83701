"""Checks that cells fill a body exactly once: not twisted, folded, overlapping or torn.

A twisted cell or a crack does not stop a finite element solver, but it changes the result. Facets
are identified by node numbers; nodes with different numbers are different, even at one position.
"""

from __future__ import annotations

from itertools import chain

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from iceslide_fem.mesh.tagged import FACETS, IntArray, TaggedMesh, among, facets_of
from iceslide_fem.runtime.arrays import Array

_CORNERS = {  # of the reference cell
    "quadrilateral": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    "hexahedron": [(x, y, z) for z in (-1, 1) for x, y in [(-1, -1), (1, -1), (1, 1), (-1, 1)]],
}
EMPTY = {"triangle": 1e-4, "tetrahedron": 1e-6, "quadrilateral": 1e-3, "hexahedron": 1e-3}
TOUCH = 1e-3  # of a facet's shortest edge: distance at which a node lies on it,
ROUNDING = 1e-6  # or of the mesh's size
INSIDE = 1e-3  # of the distance from a facet to the centre of its cell
CHUNK = 20_000  # cells whose Jacobians are computed at a time

Fault = tuple[str, Array]  # message, and coordinates (m)


def place(where: Array, unit: str = "mm", size: float = 1e-3, digits: int = 3) -> str:
    """The coordinates `where` (m) of a fault in a `unit` of `size` (m): "(1.2, 0, 3) mm"."""
    return f"({', '.join(f'{value / size:.{digits}g}' for value in where)}) {unit}"


class Soundness:
    """Facets of a mesh, and the connection of its cells."""

    def __init__(self, tagged: TaggedMesh) -> None:
        self._points, self._cells, self._kind = tagged.points, tagged.cells, tagged.cell_type
        self._middles = tagged.points[tagged.cells].mean(axis=1)
        self._facets = facets_of(tagged)
        self._owner = np.repeat(np.arange(len(self._cells)), len(FACETS[self._kind]))
        _, first, number, count = np.unique(
            np.sort(self._facets, axis=1),
            axis=0,
            return_index=True,
            return_inverse=True,
            return_counts=True,
        )
        self._count = count[number.ravel()]  # of the cells of a facet
        order = np.argsort(number.ravel(), kind="stable")
        self._outside = np.sort(first[count == 1])  # indices of outer facets in `_facets`
        self._pairs = order[self._count[order] == 2].reshape(-1, 2)  # both sides of inner facets

    def fault(self, held: IntArray, name: str = "plate") -> Fault | None:
        """The first fault; held: facets (n, corners) with the `name`, to which all parts
        connect.
        """
        return (
            self._twisted()
            or self._folded()
            or self._pinched()
            or self._loose(held, name)
            or self._touching()
            or self._overlapping()
        )

    @property
    def outer(self) -> IntArray:
        """Facets of one cell only, (n, corners)."""
        return self._facets[self._outside]

    def _twisted(self) -> Fault | None:
        """Fault of a twisted cell, by scaled Jacobian determinants at corners and between."""
        shapes = np.empty(len(self._cells))
        for start in range(0, len(self._cells), CHUNK):
            corners = self._points[self._cells[start : start + CHUNK]]
            # (cells, points, dim, dim)
            jacobian = corners.swapaxes(1, 2)[:, None] @ shape_gradients(self._kind)
            size = np.prod(np.linalg.norm(jacobian, axis=-2), axis=-1)
            det = np.linalg.det(jacobian) / np.where(size > 0.0, size, 1.0)
            # the opposite orientation is valid: the majority of signs decides
            mirrored = np.sum(np.sign(det), axis=1, keepdims=True) < 0.0
            shapes[start : start + CHUNK] = np.where(mirrored, -det, det).min(axis=1)
        cell = shapes.argmin()
        if shapes[cell] >= EMPTY[self._kind]:
            return None
        what = (
            "is inside out in a corner: it is twisted, or its nodes are in another order"
            if shapes[cell] < -EMPTY[self._kind]
            else "is empty or flat in a corner"
        )
        return f"the cell there {what}", self._middles[cell]

    def _folded(self) -> Fault | None:
        """Fault of a facet with three cells, or of two cells on the same side of a facet."""
        many = self._count.argmax()
        if self._count[many] > 2:
            at = self._points[self._facets[many]].mean(axis=0)
            return f"a facet there belongs to {self._count[many]} cells", at
        centre, normal = planes(self._points[self._facets[self._pairs[:, 0]]])
        one, other = (
            np.einsum("fi,fi->f", self._middles[self._owner[side]] - centre, normal)
            for side in self._pairs.T
        )
        wrong = np.flatnonzero(one * other >= 0.0)
        if wrong.size:
            return "cells overlap there: the mesh is folded", centre[wrong[0]]
        return None

    def _pinched(self) -> Fault | None:
        """Fault of a node whose cells are not connected by facets there."""
        count = len(self._points)
        cells = np.arange(len(self._cells))
        corners = np.sort((cells[:, None] * count + self._cells).ravel())  # of (cell, node)
        nodes = self._facets[self._pairs[:, 0]]
        links = [
            np.searchsorted(corners, (self._owner[side][:, None] * count + nodes).ravel())
            for side in self._pairs.T
        ]
        _, fan = connected(np.stack(links, axis=1), len(corners))
        _, first = np.unique(fan, return_index=True)
        fans = np.bincount(corners[first] % count, minlength=count)
        wrong = np.flatnonzero(fans > 1)
        if wrong.size:
            what = "parts hang together by a node or an edge only there; they must share facets"
            return what, self._points[wrong[0]]
        return None

    def _loose(self, held: IntArray, name: str) -> Fault | None:
        """Fault of a part without a `held` facet."""
        parts, part = connected(self._owner[self._pairs], len(self._cells))
        hanging = self._outside[among(self.outer, held)]
        loose = np.setdiff1d(np.arange(parts), part[self._owner[hanging]])
        if loose.size:
            what = f'the part there is loose: no facet of it is tagged "{name}"'
            return what, self._middles[np.argmax(part == loose[0])]
        return None

    def _touching(self) -> Fault | None:
        """Fault of an outer node on a foreign outer facet: crack, hanging node, closed slot."""
        facets = self.outer
        nodes = np.unique(facets)
        # a quadrilateral as two triangles
        halves = [facets] if facets.shape[1] < 4 else [facets[:, [0, 1, 2]], facets[:, [2, 3, 0]]]
        whole = np.concatenate([facets] * len(halves))
        corners = self._points[np.concatenate(halves)]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        near = np.maximum(TOUCH * edges.min(axis=1), ROUNDING * np.ptp(self._points, axis=0).max())
        facet, node = _within(self._points[nodes], corners, near)
        node = nodes[node]
        foreign = (whole[facet] != node[:, None]).all(axis=1)
        facet, node = facet[foreign], node[foreign]
        if not facet.size:
            return None
        touching = _distance(self._points[node], corners[facet]) <= near[facet]
        if not touching.any():
            return None
        facet, node = facet[touching][0], node[touching][0]
        at = self._points[node]
        apart = np.linalg.norm(self._points[whole[facet]] - at, axis=1).min()
        what = (
            "two nodes lie at one place there: a crack, or parts that are not joined"
            if apart <= near[facet]
            else "a node lies on a facet there that is not its own: it hangs, or a gap is closed"
        )
        return what, at

    def _overlapping(self) -> Fault | None:
        """Fault of an outer node, or a centre of an outer facet, inside a foreign cell."""
        facets = self.outer
        nodes = np.unique(facets)
        samples = np.concatenate([self._points[nodes], self._points[facets].mean(axis=1)])
        owners = np.concatenate([np.repeat(nodes[:, None], facets.shape[1], axis=1), facets])
        cell, sample = _within(samples, self._points[self._cells], np.zeros(len(self._cells)))
        foreign = np.ones(len(cell), dtype=bool)
        for corner in self._cells.T:
            foreign &= (owners[sample] != corner[cell][:, None]).all(axis=1)
        cell, sample = cell[foreign], sample[foreign]
        inside = np.ones(len(cell), dtype=bool)
        for facet in FACETS[self._kind]:
            centre, normal = planes(self._points[self._cells[cell][:, facet]])
            depth = np.einsum("fi,fi->f", samples[sample] - centre, normal)
            inside &= depth / np.einsum("fi,fi->f", self._middles[cell] - centre, normal) > INSIDE
        if inside.any():
            return "parts overlap there", samples[sample[inside][0]]
        return None


def shape_gradients(kind: str) -> Array:
    """Derivatives of the linear shape functions of a kind of cell, at its corners and between them:
    (points, corners, dim); on the reference cell, [-1, 1] along each axis but for simplices.
    """
    if kind not in _CORNERS:
        dim = 2 if kind == "triangle" else 3
        return np.concatenate([-np.ones((1, dim)), np.eye(dim)])[None]
    corners = np.array(_CORNERS[kind], dtype=float)
    dim = corners.shape[1]
    at = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * dim), axis=-1).reshape(-1, dim)
    factors = 1.0 + corners * at[:, None, :]  # (points, corners, dim)
    others = [np.delete(factors, axis, axis=2).prod(axis=2) for axis in range(dim)]
    return corners * np.stack(others, axis=2) / 2**dim


def planes(corners: Array) -> tuple[Array, Array]:
    """Centre and a normal of facets (n, corners, dim)."""
    if corners.shape[-1] == 2:
        along = corners[:, 1] - corners[:, 0]
        return corners.mean(axis=1), np.stack([along[:, 1], -along[:, 0]], axis=1)
    one = corners[:, 2] - corners[:, 0]
    other = (
        corners[:, 3] - corners[:, 1] if corners.shape[1] == 4 else corners[:, 1] - corners[:, 0]
    )
    return corners.mean(axis=1), np.cross(one, other)


def connected(pairs: IntArray, size: int) -> tuple[int, IntArray]:
    """Connected components of `size` items with links (n, 2): their number, and each item's."""
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    count, part = connected_components(links, directed=False)
    return int(count), part


def _within(points: Array, corners: Array, more: Array) -> tuple[IntArray, IntArray]:
    """Pairs (body, point) of points within a body's bounding ball, enlarged by `more` (m)."""
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1) + more
    found = cKDTree(points).query_ball_point(centres, radii)
    counts = [len(some) for some in found]
    inside = np.fromiter(chain.from_iterable(found), dtype=np.int64, count=sum(counts))
    return np.repeat(np.arange(len(found)), counts), inside


def _distance(points: Array, corners: Array) -> Array:
    """Distances of points (n, dim) to segments or triangles (n, 2 or 3, dim); inf beside one."""
    base, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
    gram = np.einsum("nai,nbi->nab", edges, edges)
    right = np.einsum("nai,ni->na", edges, points - base)
    weights = np.linalg.solve(gram, right[..., None])[..., 0]
    weights = np.concatenate([1.0 - weights.sum(axis=1, keepdims=True), weights], axis=1)
    nearest = np.einsum("na,nai->ni", weights, corners)
    inside = (weights >= -TOUCH).all(axis=1)
    return np.where(inside, np.linalg.norm(points - nearest, axis=1), np.inf)
