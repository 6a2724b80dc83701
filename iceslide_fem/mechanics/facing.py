"""Nearest points of facing walls of sipes and grooves.

The point y of a facing facet nearest to x fulfils t_a . (x - y) = 0 with the facet's tangents t_a.
If y is on the facet's rim, this holds along the rim only.

Shapes: F facets, q points each, a nodes, d components; P pairs of a point and its nearest one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.mechanics.contact_surface import area_vectors
from iceslide_fem.runtime.arrays import Array, Index, Mask

FACING = -0.5  # facets face each other if the product of their normals is below this
# Number of candidate facets, by the distance of their centres.
NEIGHBOURS = {"interval": 5, "quadrilateral": 12, "triangle": 20}
MOVED = 0.2  # of the smallest facet's size: by so much nodes move before neighbours are listed anew
PROJECTIONS = 30
CONVERGED = 1e-9  # change of a facet's coordinates; the error is of the order of its square
BULGE = 0.2  # of its size: upper bound of a facet's curvature
# Largest motion of a point of a quadratic facet over that of its nodes (Lebesgue's constant).
OF_A_NODE = 1.67
SLIPPED_OFF = 0.7  # a point is beside the end of a wall if the cosine to its normal is below this
# Unit normals of a facet's rim in reference coordinates, and the rim's distances along them.
_ROOT = 0.5**0.5
RIMS: dict[str, list[tuple[tuple[float, ...], float]]] = {
    "interval": [((-1.0,), 0.0), ((1.0,), 1.0)],
    "quadrilateral": [
        ((-1.0, 0.0), 0.0),
        ((1.0, 0.0), 1.0),
        ((0.0, -1.0), 0.0),
        ((0.0, 1.0), 1.0),
    ],
    "triangle": [((-1.0, 0.0), 0.0), ((0.0, -1.0), 0.0), ((_ROOT, _ROOT), _ROOT)],
}
ON_THE_RIM, ROUNDING = 1e-12, 1e-9


class Facets(NamedTuple):
    """Undeformed facets of all ranks.

    kind: their cell; element: of basix; nodes (F, a, d), m; shape (F, q, a): shape functions at
    their points; outwards (F, d): mean unit normals; sign (F,): makes the area vectors of the
    facet's coordinates point outwards.
    """

    kind: str
    element: Any
    nodes: Array
    shape: Array
    outwards: Array
    sign: Array

    def tabulate(self, place: Array) -> tuple[Array, Array, Array]:
        """Shape functions (P, a), first (P, d-1, a) and second derivatives (P, d-1, d-1, a) at
        coordinates (P, d-1).
        """
        sides, a = self.nodes.shape[2] - 1, self.nodes.shape[1]
        if not len(place):
            return np.zeros((0, a)), np.zeros((0, sides, a)), np.zeros((0, sides, sides, a))
        table = np.array(self.element.tabulate(2, place))[..., 0]
        if sides == 1:
            return table[0], table[1][:, None], table[2][:, None, None]
        slopes = np.stack([table[1], table[2]], axis=1)  # basix: 1, x, y, xx, xy, yy
        bends = np.stack(
            [np.stack([table[3], table[4]], axis=1), np.stack([table[4], table[5]], axis=1)], axis=1
        )
        return table[0], slopes, bends


class Pressing(NamedTuple):
    """Points in or before a facing wall.

    point: (slave facet, its quadrature point); facet: of the facing wall; place (P, d-1): reference
    coordinates of the nearest point; shape (P, a), slopes (P, d-1, a), bends (P, d-1, d-1, a):
    shape functions there and their first and second derivatives; apart: r = x - y (P, d), m;
    tangents (P, d-1, d); ways (P, d-1, d-1): projectors on the free directions of the nearest
    point; opening (P,): distance, negative for penetration, m.
    """

    point: tuple[Index, Index]
    facet: Index
    place: Array
    shape: Array
    slopes: Array
    bends: Array
    apart: Array
    tangents: Array
    ways: Array
    opening: Array

    def chosen(self, which: Index | Mask) -> Pressing:
        """Some of the points."""
        slave, point = self.point
        rest: list[Any] = [part[which] for part in self[1:]]
        return Pressing((slave[which], point[which]), *rest)


class FacingWalls:
    """Search of nearest points among facets that may come into contact."""

    def __init__(self, facets: Facets) -> None:
        self._facets = facets
        self._rims = RIMS[facets.kind]
        self._middle, sizes = _spheres(facets.nodes)
        main = np.abs(facets.outwards).argmax(axis=1)
        way = np.take_along_axis(facets.outwards, main[:, None], axis=1)[:, 0] > 0.0
        self._side = 2 * main + way  # facets with similar normals
        self._reach = MOVED * float(sizes.min(initial=np.inf))
        # Nodes and points with the `_neighbours` there.
        self._listed: tuple[Array, Array, tuple[Index, Index, Index]] | None = None
        # Nodes about their mean (F, a, d), and lower bounds of the points' openings (F, q), m.
        self._visited: tuple[Array, Array] | None = None

    def nearest(self, positions: Array, x: Array, everywhere: bool) -> Pressing:
        """Nearest points on facing walls to the points `x` (F, q, d), m.

        positions: deformed nodes (F, a, d), m; everywhere: for all points, else only for points
        near enough to penetrate a wall.
        """
        kept = slice(None) if everywhere else self._before(positions, x)
        return self._among(kept, positions, x)

    def smallest_opening(self, positions: Array, x: Array, below: float) -> float:
        """Smallest distance (m) of the points `x` (F, q, d) from facing walls, as `nearest`, if it
        is `below` that; infinite else.

        A point is only looked at if walls have moved so far since the last time that it may be so
        near.
        """
        shape = positions - positions.mean(axis=(0, 1))
        if self._visited is None:
            self._visited = shape, np.full(x.shape[:2], -np.inf)
        before, least = self._visited
        least -= 2.0 * OF_A_NODE * np.linalg.norm(shape - before, axis=2).max(initial=0.0)
        slave, point, _ = self._facing(positions, x)
        found = self._among((least < below)[slave, point], positions, x)
        least[found.point] = found.opening
        self._visited = shape, least
        smallest = float(found.opening.min(initial=np.inf))
        return smallest if smallest < below else np.inf

    def _bounds(self, positions: Array, at: Array, facet: Index) -> tuple[Array, Array]:
        """Bounds (m) of the distances of points `at` (P, d) from facets: the lower one by a sphere
        around the facet, the upper one by its nodes.
        """
        centres, size = _spheres(positions)
        apart = np.linalg.norm(at[:, None] - positions[facet], axis=2).min(axis=1)
        middle = np.linalg.norm(at - centres[facet], axis=1)
        return middle - (1.0 + BULGE) * size[facet], apart

    def _among(self, kept: Mask | slice, positions: Array, x: Array) -> Pressing:
        """The nearest points by the facing triples that are `kept`."""
        slave, point, facet = (part[kept] for part in self._facing(positions, x))
        least, most = self._bounds(positions, x[slave, point], facet)
        number, nearest = slave * x.shape[1] + point, np.full(x.shape[0] * x.shape[1], np.inf)
        np.minimum.at(nearest, number, most)
        near = least <= nearest[number]
        slave, point, facet = slave[near], point[near], facet[near]
        at = x[slave, point]
        place, ways = self._project(at, positions[facet])
        shape, slopes, bends = self._facets.tabulate(place)
        apart = at - np.einsum("pa,pad->pd", shape, positions[facet])
        tangents = slopes @ positions[facet]
        distance = np.linalg.norm(apart, axis=1)
        depth = -np.einsum("pd,pd->p", apart, _outwards(tangents, self._facets.sign[facet]))
        within = np.trace(ways, axis1=1, axis2=2) > ways.shape[1] - 0.5
        inside = (depth > 0.0) & (within | (depth > SLIPPED_OFF * distance))
        opening = np.where(inside, -distance, distance)
        number = slave * x.shape[1] + point
        order = np.lexsort((distance, number))
        best = order[np.unique(number[order], return_index=True)[1]]
        found = Pressing(
            (slave, point), facet, place, shape, slopes, bends, apart, tangents, ways, opening
        )
        return found.chosen(best)

    def _facing(self, positions: Array, x: Array) -> tuple[Index, Index, Index]:
        """Triples of slave facet, its point, and a facet near it that faces it."""
        if self._listed is None or self._left(self._listed[:2], (positions, x)):
            self._listed = positions, x, self._neighbours(positions, x)
        return self._listed[2]

    def _before(self, positions: Array, x: Array) -> Mask:
        """Which of the facing triples may have the point in or just before the facet."""
        slave, point, facet = self._facing(positions, x)
        centres, size = _spheres(positions)
        sides = positions[:, 1 : x.shape[2]] - positions[:, :1]  # from the first corner
        normal = _outwards(sides, self._facets.sign)
        away = x[slave, point] - centres[facet]
        return np.asarray(np.einsum("pd,pd->p", away, normal[facet]) < BULGE * size[facet])

    def _left(self, before: tuple[Array, ...], now: tuple[Array, ...]) -> bool:
        """Whether nodes or points have moved so far that they may have other neighbours."""
        moved = (
            np.abs(one - other).max(initial=0.0) for one, other in zip(now, before, strict=True)
        )
        return any(far > self._reach for far in moved)

    def _neighbours(self, positions: Array, x: Array) -> tuple[Index, Index, Index]:
        """Triples of slave facet, its point, and a facet near it that faces it."""
        centres, dim = positions.mean(axis=1), x.shape[2]
        triples = [np.zeros((3, 0), dtype=np.intp)]
        for side in np.unique(self._side):
            slaves, masters = (np.flatnonzero(self._side == s) for s in (side, side ^ 1))
            if not len(masters):
                continue
            count = min(NEIGHBOURS[self._facets.kind], len(masters))
            points = x[slaves].reshape(-1, dim)
            _, near = cKDTree(centres[masters]).query(points, count)
            facet = masters[near.reshape(len(points), count)]
            number = np.repeat(np.arange(len(points)), count)
            one = [slaves[number // x.shape[1]], number % x.shape[1], facet.ravel()]
            triples.append(np.stack(one))
        slave, point, facet = np.concatenate(triples, axis=1)
        kept = self._face_each_other(slave, facet)
        return slave[kept], point[kept], facet[kept]

    def _face_each_other(self, one: Index, other: Index) -> Mask:
        """Whether two facets face each other in the undeformed body."""
        outwards = self._facets.outwards
        across = self._middle[other] - self._middle[one]
        turned = np.einsum("pd,pd->p", outwards[one], outwards[other]) < FACING
        ahead = np.einsum("pd,pd->p", across, outwards[one]) > 0.0
        behind = np.einsum("pd,pd->p", across, outwards[other]) < 0.0
        return np.asarray(turned & ahead & behind)

    def _project(self, x: Array, nodes: Array) -> tuple[Array, Array]:
        """Coordinates (P, d-1) of the nearest points, and their free directions `ways`.

        Newton's method for the minimum of |r|^2 / 2 within the facet.
        """
        sides = nodes.shape[2] - 1
        centre = 1.0 / 3.0 if self._facets.kind == "triangle" else 0.5
        place = np.full((len(x), sides), centre)
        ways = np.broadcast_to(np.eye(sides), (len(x), sides, sides))
        for _ in range(PROJECTIONS):
            shape, slopes, bends = self._facets.tabulate(place)
            apart = x - np.einsum("pa,pad->pd", shape, nodes)
            tangents = slopes @ nodes
            descent = np.einsum("psd,pd->ps", tangents, apart)
            ways = self._ways(place, descent)
            metric = tangents @ tangents.swapaxes(1, 2)
            curved = metric - np.einsum(
                "pstd,pd->pst", np.einsum("psta,pad->pstd", bends, nodes), apart
            )
            definite = np.linalg.det(curved) > 0.1 * np.linalg.det(metric)
            definite &= np.trace(curved, axis1=1, axis2=2) > 0.0
            hessian = restricted(np.where(definite[:, None, None], curved, metric), ways)
            # a trial of Newton's method may fold a facet to a line
            hessian[np.linalg.det(hessian) == 0.0] = np.eye(sides)
            step = np.linalg.solve(hessian, ways @ descent[..., None])[..., 0]
            following = self._within(place + step)
            moved = np.abs(following - place).max(initial=0.0)
            place = following
            if moved < CONVERGED:
                break
        return place, ways

    def _ways(self, place: Array, descent: Array) -> Array:
        """Projectors (P, s, s) on the directions that do not leave the facet.

        place: coordinates (P, s); descent: search direction.
        """
        ways = np.tile(np.eye(place.shape[1]), (len(place), 1, 1))
        rounding = ROUNDING * np.linalg.norm(descent, axis=1)
        for rim, limit in 2 * self._rims:  # a constraint at one rim may violate another
            normal = np.array(rim)
            out = (ways @ descent[..., None])[..., 0] @ normal > rounding
            held = np.flatnonzero(out & (place @ normal >= limit - ON_THE_RIM))
            across = ways[held] @ normal
            across /= np.linalg.norm(across, axis=1, keepdims=True)
            ways[held] -= across[:, :, None] * across[:, None, :]
        return ways

    def _within(self, place: Array) -> Array:
        """Projection of coordinates onto the facet."""
        if self._facets.kind == "triangle":
            place = np.maximum(place, 0.0)
            place = place - 0.5 * np.maximum(place.sum(axis=1, keepdims=True) - 1.0, 0.0)
        return np.clip(place, 0.0, 1.0)


def restricted(matrix: Array, ways: Array) -> Array:
    """Systems (P, s, s) restricted to the directions `ways`: W M W + (1 - W)."""
    return np.asarray(ways @ matrix @ ways + np.eye(ways.shape[1]) - ways)


def _spheres(nodes: Array) -> tuple[Array, Array]:
    """Centres (F, d) of facets with `nodes` (F, a, d), and their largest distances (F,), m."""
    centres = nodes.mean(axis=1)
    return centres, np.linalg.norm(nodes - centres[:, None], axis=2).max(axis=1)


def _outwards(tangents: Array, sign: Array) -> Array:
    """Outward unit normals (n, d) of facets with tangents (n, d-1, d)."""
    normal = area_vectors(tangents) * sign[:, None]
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
