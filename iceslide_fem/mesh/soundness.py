"""Whether the cells of a mesh fill a body once: nothing twisted, folded, overlapping or torn.

A twisted cell or a crack does not stop a finite element solver, it changes its result. Facets
are found again by their nodes; nodes of different numbers are different, wherever they lie.
"""

from __future__ import annotations

from functools import cached_property
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from iceslide_fem.mesh.tagged import IntArray, TaggedMesh

Floats = NDArray[np.float64]

FACETS: dict[str, list[tuple[int, ...]]] = {
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quadrilateral": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetrahedron": [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)],
    "hexahedron": [
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    ],
}
_CORNERS = {  # of the reference cell
    "quadrilateral": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    "hexahedron": [(x, y, z) for z in (-1, 1) for x, y in [(-1, -1), (1, -1), (1, 1), (-1, 1)]],
}
EMPTY = {"triangle": 1e-4, "tetrahedron": 1e-6, "quadrilateral": 1e-3, "hexahedron": 1e-3}
TOUCH = 1e-3  # of a facet's shortest edge: nearer than that a node lies on it,
ROUNDING = 1e-6  # or of the mesh's size
INSIDE = 1e-3  # of the way from a facet to the middle of its cell
CHUNK = 20_000  # cells whose Jacobians are computed at a time

Fault = tuple[str, Floats]  # what is wrong, and the coordinates (m) where


def facets_of(tagged: TaggedMesh) -> IntArray:
    """Facets of all cells, inner ones twice: (cells * facets of a cell, corners of a facet)."""
    facets = tagged.cells[:, np.array(FACETS[tagged.cell_type])]
    return facets.reshape(-1, facets.shape[-1])


def outer_facets(tagged: TaggedMesh) -> IntArray:
    """Facets of one cell only, (n, corners)."""
    facets = facets_of(tagged)
    _, first, count = np.unique(
        np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True
    )
    return facets[np.sort(first[count == 1])]


def place(where: Floats, unit: str = "mm", size: float = 1e-3, digits: int = 3) -> str:
    """The coordinates `where` (m) of a fault in a `unit` of `size` (m): "(1.2, 0, 3) mm"."""
    return f"({', '.join(f'{value / size:.{digits}g}' for value in where)}) {unit}"


def among(facets: IntArray, others: IntArray) -> NDArray[np.bool_]:
    """Whether each of the facets (n, corners) is one of the `others`, in any order of corners."""
    both = np.sort(np.concatenate([facets, others]), axis=1)
    _, number = np.unique(both, axis=0, return_inverse=True)
    number = number.ravel()
    return np.isin(number[: len(facets)], number[len(facets) :])


def smallest_angle(tagged: TaggedMesh) -> float:
    """Smallest angle between two edges that meet in a corner of a cell's face, degrees."""
    faces = np.array(FACETS[tagged.cell_type])
    flat = tagged.points.shape[1] == 2
    corners = tagged.points[tagged.cells if flat else tagged.cells[:, faces]]
    before, after = (np.roll(corners, way, axis=-2) - corners for way in (1, -1))
    lengths = np.linalg.norm(before, axis=-1) * np.linalg.norm(after, axis=-1)
    cosine = np.clip((before * after).sum(axis=-1) / lengths, -1.0, 1.0)
    return float(np.degrees(np.arccos(cosine.max())))


class Soundness:
    """Facets of a mesh and how its cells hang together."""

    def __init__(self, tagged: TaggedMesh) -> None:
        self._points, self._cells, self._kind = tagged.points, tagged.cells, tagged.cell_type
        self._per_cell = np.array(FACETS[self._kind])
        self._facets = facets_of(tagged)
        _, first, self._number, self._count = np.unique(
            np.sort(self._facets, axis=1),
            axis=0,
            return_index=True,
            return_inverse=True,
            return_counts=True,
        )
        self._number = self._number.ravel()
        self._owner = np.repeat(np.arange(len(self._cells)), len(self._per_cell))
        self._outside = np.sort(first[self._count == 1])  # places of outer facets in `_facets`

    def fault(self, held: IntArray, name: str = "plate") -> Fault | None:
        """The first thing that is wrong; `held` are the facets (n, corners) with that `name`, from
        one of which all of the body must hang.
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

    @cached_property
    def _middles(self) -> Floats:
        """Of cells, (n, dim)."""
        return np.asarray(self._points[self._cells].mean(axis=1))

    @cached_property
    def _pairs(self) -> IntArray:
        """Places in `_facets` of both sides of every inner facet, (n, 2)."""
        order = np.argsort(self._number, kind="stable")
        inner = order[self._count[self._number[order]] == 2]
        return inner.reshape(-1, 2)

    def _twisted(self) -> Fault | None:
        """Determinants of the Jacobian over the lengths of its columns, at corners and between."""
        gradients = _gradients(self._kind)
        worst, cell = np.inf, 0
        for start in range(0, len(self._cells), CHUNK):
            corners = self._points[self._cells[start : start + CHUNK]]
            jacobian = corners.swapaxes(1, 2)[:, None] @ gradients  # (cells, points, dim, dim)
            size = np.prod(np.linalg.norm(jacobian, axis=-2), axis=-1)
            det = np.linalg.det(jacobian) / np.where(size > 0.0, size, 1.0)
            # cells numbered the other way round are as good: the sign of most points counts
            mirrored = np.sum(np.sign(det), axis=1, keepdims=True) < 0.0
            shape = np.where(mirrored, -det, det).min(axis=1)
            if shape.min() < worst:
                worst, cell = float(shape.min()), start + int(shape.argmin())
        if worst >= EMPTY[self._kind]:
            return None
        what = (
            "is inside out in a corner: it is twisted, or its nodes are in another order"
            if worst < -EMPTY[self._kind]
            else "is empty or flat in a corner"
        )
        return f"the cell there {what}", self._middles[cell]

    def _folded(self) -> Fault | None:
        """Facets of three cells, and cells that lie on the same side of their common facet."""
        many = np.flatnonzero(self._count[self._number] > 2)
        if many.size:
            at = self._points[self._facets[many[0]]].mean(axis=0)
            return f"a facet there belongs to {self._count[self._number[many[0]]]} cells", at
        one, other = self._pairs.T
        centre, normal = planes(self._points[self._facets[one]])
        sides = [
            np.einsum("fi,fi->f", self._middles[self._owner[side]] - centre, normal)
            for side in (one, other)
        ]
        wrong = np.flatnonzero(sides[0] * sides[1] >= 0.0)
        if wrong.size:
            return "cells overlap there: the mesh is folded", centre[wrong[0]]
        return None

    def _pinched(self) -> Fault | None:
        """Nodes whose cells do not hang together by facets at that node."""
        corners = self._cells.shape[1]
        place = np.arange(self._cells.size).reshape(self._cells.shape)  # of (cell, corner)
        one, other = self._pairs.T
        first = place[self._owner[one]][
            np.arange(len(one))[:, None], self._per_cell[one % len(self._per_cell)]
        ]
        # the same nodes on the other side of the facet
        others = self._cells[self._owner[other]]
        matching = (others[:, None, :] == self._facets[one][:, :, None]).argmax(axis=2)
        second = self._owner[other][:, None] * corners + matching
        links = _graph(first.ravel(), second.ravel(), self._cells.size)
        _, fan = connected_components(links, directed=False)
        node_of_fan = np.full(fan.max() + 1, -1)
        node_of_fan[fan] = self._cells.ravel()
        fans = np.bincount(node_of_fan, minlength=len(self._points))
        wrong = np.flatnonzero(fans > 1)
        if wrong.size:
            what = "parts hang together by a node or an edge only there; they must share facets"
            return what, self._points[wrong[0]]
        return None

    def _loose(self, held: IntArray, name: str) -> Fault | None:
        """Parts without one of the facets that are `held`."""
        links = _graph(
            self._owner[self._pairs[:, 0]], self._owner[self._pairs[:, 1]], len(self._cells)
        )
        parts, part = connected_components(links, directed=False)
        hanging = self._outside[among(self.outer, held)]
        loose = np.setdiff1d(np.arange(parts), part[self._owner[hanging]])
        if loose.size:
            cell = int(np.argmax(part == loose[0]))
            what = f'the part there is loose: no facet of it is tagged "{name}"'
            return what, self._middles[cell]
        return None

    def _touching(self) -> Fault | None:
        """Outer nodes on an outer facet that is not theirs: cracks, hanging nodes, closed slots."""
        facets = self.outer
        nodes = np.unique(facets)
        # a quadrilateral as two triangles
        halves = [facets] if facets.shape[1] < 4 else [facets[:, [0, 1, 2]], facets[:, [2, 3, 0]]]
        simplices = np.concatenate(halves)
        whole = np.concatenate([facets] * len(halves))
        corners = self._points[simplices]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        near = np.maximum(TOUCH * edges.min(axis=1), ROUNDING * np.ptp(self._points, axis=0).max())
        tree = cKDTree(self._points[nodes])
        facet, node = _within(tree, corners, near)
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
        """Outer nodes, and middles of outer facets, inside cells that they have no node of."""
        facets = self.outer
        nodes = np.unique(facets)
        samples = np.concatenate([self._points[nodes], self._points[facets].mean(axis=1)])
        owners = np.concatenate([np.repeat(nodes[:, None], facets.shape[1], axis=1), facets])
        cell, sample = _within(
            cKDTree(samples), self._points[self._cells], np.zeros(len(self._cells))
        )
        foreign = np.ones(len(cell), dtype=bool)
        for corner in self._cells.T:
            foreign &= (owners[sample] != corner[cell][:, None]).all(axis=1)
        cell, sample = cell[foreign], sample[foreign]
        inside = np.ones(len(cell), dtype=bool)
        for facet in self._per_cell:
            centre, normal = planes(self._points[self._cells[cell][:, facet]])
            depth = np.einsum("fi,fi->f", samples[sample] - centre, normal)
            inside &= depth / np.einsum("fi,fi->f", self._middles[cell] - centre, normal) > INSIDE
        if inside.any():
            return "parts overlap there", samples[sample[inside][0]]
        return None


def _gradients(kind: str) -> Floats:
    """Derivatives of the shape functions: (points, corners, dim), at corners and between them."""
    if kind in ("triangle", "tetrahedron"):
        dim = 2 if kind == "triangle" else 3
        return np.concatenate([-np.ones((1, dim)), np.eye(dim)])[None]
    corners = np.array(_CORNERS[kind], dtype=float)
    dim = corners.shape[1]
    at = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * dim), axis=-1).reshape(-1, dim)
    factors = 1.0 + corners * at[:, None, :]  # (points, corners, dim)
    found = np.empty_like(factors)
    for axis in range(dim):
        others = np.delete(factors, axis, axis=2)
        found[:, :, axis] = corners[:, axis] * others.prod(axis=2) / 2**dim
    return found


def planes(corners: Floats) -> tuple[Floats, Floats]:
    """Middle and a normal of facets (n, corners, dim)."""
    if corners.shape[-1] == 2:
        along = corners[:, 1] - corners[:, 0]
        return corners.mean(axis=1), np.stack([along[:, 1], -along[:, 0]], axis=1)
    count = corners.shape[1]
    one = corners[:, 2] - corners[:, 0]
    other = corners[:, 3] - corners[:, 1] if count == 4 else corners[:, 1] - corners[:, 0]
    return corners.mean(axis=1), np.cross(one, other)


def _graph(one: IntArray, other: IntArray, size: int) -> coo_array:
    return coo_array((np.ones(len(one)), (one, other)), shape=(size, size))


def _within(tree: cKDTree, corners: Floats, more: Floats) -> tuple[IntArray, IntArray]:
    """Pairs of (body, point) where a point of the tree is in the ball around a body's corners."""
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1) + more
    found = tree.query_ball_point(centres, radii)
    counts = np.fromiter(map(len, found), dtype=np.int64, count=len(found))
    points = np.fromiter(chain.from_iterable(found), dtype=np.int64, count=int(counts.sum()))
    return np.repeat(np.arange(len(found)), counts), points


def _distance(points: Floats, corners: Floats) -> Floats:
    """Of points (n, dim) to segments or triangles (n, 2 or 3, dim); inf beside a triangle."""
    base, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
    gram = np.einsum("nai,nbi->nab", edges, edges)
    right = np.einsum("nai,ni->na", edges, points - base)
    shares = np.linalg.solve(gram, right[..., None])[..., 0]
    shares = np.concatenate([1.0 - shares.sum(axis=1, keepdims=True), shares], axis=1)
    nearest = np.einsum("na,nai->ni", shares, corners)
    inside = (shares >= -TOUCH).all(axis=1)
    return np.where(inside, np.linalg.norm(points - nearest, axis=1), np.inf)
