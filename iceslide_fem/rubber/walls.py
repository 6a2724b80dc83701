"""Walls that meet: penalty contact between the facing walls of sipes and grooves, frictionless.

Every point x of a wall that has gone through a facing wall by the distance e = |r|, r = x - y with
the wall's nearest point y, stores the energy eps / 4 e^2 per undeformed area. Each wall is taken
for the one that presses and for the one that is pressed (two half passes, R. A. Sauer and L. De
Lorenzis, Int. J. Numer. Meth. Engng 101 (2015) 251), so the pressure between them is eps e.

Forces and tangent are the derivatives of that energy. With r = B u + const, B of the point's and
the nearest point's shape functions, and y found from t_a . r = 0 (its tangents t_a),

    force = k B^T r,  tangent = k (B^T B - G_a M_ab^-1 G_b^T),
    M_ab = t_a . t_b - r . y_,ab,  G_a = -B^T t_a + (dB/dxi_a)^T r

without the second part where y lies on a facet's rim. Walls are small: every rank knows all of
them, computes all that they do to each other, and keeps what acts on its own nodes.

Shapes: F facets, q points each, a nodes, d components; P points that press.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.arrays import Array, Index, Mask
from iceslide_fem.errors import SceneError
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import PETSc
from iceslide_fem.rubber.contact_surface import (
    FACET_OF,
    area_vectors,
    contact_surface,
    space_degree,
)

DEGREE = 5  # of the points on a facet
FACING = -0.5  # normals whose product is below that look at each other
NEIGHBOURS = {2: 5, 3: 12}  # facets, by their middles, among which the nearest point is looked for
PROJECTIONS = 30
CONVERGED = 1e-13  # change of a facet's coordinates
BULGE = 0.2  # of its size: no facet is more curved
SLIPPED_OFF = 0.7  # cosine to the normal below which a point is beside the end of a wall


class Pressing(NamedTuple):
    """Points in or before a facing wall.

    point: (slave facet, its quadrature point); facet: the facing wall's; shape (P, a) and its
    derivatives slopes (P, d-1, a), bends (P, d-1, d-1, a) at the nearest point; apart: r (P, d), m;
    tangents (P, d-1, d); free (P, d-1): where the nearest point is not on the facet's rim; opening
    (P,): distance, below 0 where the point is in the wall, m.
    """

    point: tuple[Index, Index]
    facet: Index
    shape: Array
    slopes: Array
    bends: Array
    apart: Array
    tangents: Array
    free: Mask
    opening: Array

    def chosen(self, which: Index | Mask) -> Pressing:
        """Some of the points."""
        slave, point = self.point
        return Pressing(
            (slave[which], point[which]),
            self.facet[which],
            self.shape[which],
            self.slopes[which],
            self.bends[which],
            self.apart[which],
            self.tangents[which],
            self.free[which],
            self.opening[which],
        )


class Walls:
    """All walls of a body that may meet, known to every rank."""

    def __init__(self, space: Any, facets: Any, penalty: float) -> None:
        """The exterior `facets` (local numbers) of a vector Lagrange space; penalty, Pa/m.

        Collective. Raises SceneError for tetrahedra and triangles.
        """
        mesh = space.mesh
        kind = FACET_OF[compat.cell_name(mesh)]
        if kind == "triangle":
            raise SceneError('facets named "walls" need a mesh of hexahedra, not of tetrahedra')
        self._own = contact_surface(space, facets, DEGREE)
        self._comm, self._dim = mesh.comm, mesh.geometry.dim
        self._element = compat.basix_lagrange(kind, space_degree(space))
        index_map = space.dofmap.index_map
        self._first, self._last = index_map.local_range
        dofs = index_map.local_to_global(self._own.dofs.ravel()).reshape(self._own.dofs.shape)
        normals = self._own.undeformed()
        self._dofs = self._gather(dofs)
        self._nodes = self._gather(self._own.nodes)
        self._shape = self._gather(self._own.shape)
        size = np.linalg.norm(normals, axis=-1)
        self._sign = self._gather(np.sign(self._own.weights))[:, 0]
        self.penalty = penalty
        self._share = 0.5 * penalty * self._gather(np.abs(self._own.weights) * size)
        outwards = self._gather((normals * np.sign(self._own.weights)[..., None]).mean(axis=1))
        self._normal = outwards / np.linalg.norm(outwards, axis=-1, keepdims=True)
        self._middle = self._nodes.mean(axis=1)
        main = np.abs(self._normal).argmax(axis=1)
        way = np.take_along_axis(self._normal, main[:, None], axis=1)[:, 0] > 0.0
        self._side = 2 * main + way  # of facets that look roughly the same way

    @property
    def count(self) -> int:
        """Number of facets on all ranks."""
        return len(self._dofs)

    def energy(self, u: Array) -> float:
        """Energy (J; J/m in a slice) of what presses at displacements `u` (blocked dofs, d).

        Collective.
        """
        found = self._pressing(self._positions(u))
        return float(0.5 * np.sum(self._share[found.point] * (found.apart**2).sum(axis=1)))

    def add_forces(self, u: Array, vector: Array) -> None:
        """Add the derivative of the energy by this rank's own nodes to `vector` (blocked dofs, d).

        Collective.
        """
        found = self._pressing(self._positions(u))
        pull = self._share[found.point][:, None] * found.apart
        for dofs, by_node in (
            (self._dofs[found.point[0]], self._shape[found.point]),
            (self._dofs[found.facet], -found.shape),
        ):
            own = (self._first <= dofs) & (dofs < self._last)
            forces = by_node[..., None] * pull[:, None, :]
            np.add.at(vector, dofs[own] - self._first, forces[own])

    def add_tangent(self, u: Array, matrix: PETSc.Mat) -> None:
        """Add the second derivative of the energy to this rank's rows of `matrix`. Collective."""
        positions = self._positions(u)
        found = self._pressing(positions)
        if not len(found.facet):  # on every rank
            return
        blocks = self._second_derivatives(found, positions[found.facet])
        dofs = np.concatenate([self._dofs[found.point[0]], self._dofs[found.facet]], axis=1)
        d = self._dim
        unknowns = (dofs[:, :, None] * d + np.arange(d)).reshape(len(dofs), -1)
        pairs, number = np.unique(
            np.stack([found.point[0], found.facet], axis=1), axis=0, return_inverse=True
        )
        sums = np.zeros((len(pairs), *blocks.shape[1:]))
        np.add.at(sums, number.ravel(), blocks)
        _, first = np.unique(number.ravel(), return_index=True)
        for block, rows in zip(sums, unknowns[first].astype(PETSc.IntType), strict=True):
            own = (self._first * d <= rows) & (rows < self._last * d)
            if own.any():
                matrix.setValues(rows[own], rows, block[own], PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()

    def smallest_opening(self, u: Array) -> float:
        """Smallest distance of a point of a wall from a facing one, m; below 0 where they press.

        Infinite where nothing faces anything. Collective.
        """
        found = self._nearest(self._positions(u), everywhere=True)
        return float(found.opening.min(initial=np.inf))

    def pressure(self, u: Array) -> tuple[Array, Array]:
        """Positions (n, d), m, of the points that press, and the pressures there (n,), Pa.

        Per undeformed area; each wall has its own points. Collective.
        """
        positions = self._positions(u)
        found = self._pressing(positions)
        slave, point = found.point
        at = np.einsum("pa,pad->pd", self._shape[slave, point], positions[slave])
        return at, self.penalty * np.linalg.norm(found.apart, axis=1)

    def _gather(self, values: Array) -> Any:
        """Arrays (F, ...) of all ranks' facets. Collective."""
        parts = [part for part in self._comm.allgather(values) if len(part)]
        return np.concatenate(parts) if parts else values

    def _positions(self, u: Array) -> Array:
        """Deformed nodes (F, a, d) of all walls, m. Collective."""
        return np.asarray(self._nodes + self._gather(u[self._own.dofs]))

    def _pressing(self, positions: Array) -> Pressing:
        """The points that are in a facing wall."""
        found = self._nearest(positions, everywhere=False)
        return found.chosen(found.opening < 0.0)

    def _nearest(self, positions: Array, everywhere: bool) -> Pressing:
        """The nearest point of the facing walls to each point, `everywhere` or where it is near
        enough that it may be in one.
        """
        slave, point, facet = self._candidates(positions, everywhere)
        x = np.einsum("pa,pad->pd", self._shape[slave, point], positions[slave])
        place, free = self._project(x, positions[facet])
        shape, slopes, bends = self._tabulate(place)
        apart = x - np.einsum("pa,pad->pd", shape, positions[facet])
        tangents = slopes @ positions[facet]
        distance = np.linalg.norm(apart, axis=1)
        normal = area_vectors(tangents) * self._sign[facet][:, None]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        depth = -np.einsum("pd,pd->p", apart, normal)
        inside = (depth > 0.0) & (free.all(axis=1) | (depth > SLIPPED_OFF * distance))
        opening = np.where(inside, -distance, distance)
        number = slave * self._shape.shape[1] + point
        order = np.lexsort((distance, number))
        best = order[np.unique(number[order], return_index=True)[1]]
        found = Pressing(
            (slave, point), facet, shape, slopes, bends, apart, tangents, free, opening
        )
        return found.chosen(best)

    def _candidates(self, positions: Array, everywhere: bool) -> tuple[Index, Index, Index]:
        """Triples of slave facet, its point, and a facing facet that may be the nearest."""
        centres = positions.mean(axis=1)
        points = np.einsum("fqa,fad->fqd", self._shape, positions)
        triples = []
        for side in np.unique(self._side):
            slaves, masters = (np.flatnonzero(self._side == s) for s in (side, side ^ 1))
            if not len(masters):
                continue
            count = min(NEIGHBOURS[self._dim], len(masters))
            x = points[slaves].reshape(-1, self._dim)
            _, near = cKDTree(centres[masters]).query(x, count)
            facet = masters[near.reshape(len(x), count)]
            number = np.repeat(np.arange(len(x)), count)
            triples.append(
                np.stack(
                    [
                        slaves[number // points.shape[1]],
                        number % points.shape[1],
                        facet.ravel(),
                    ]
                )
            )
        if not triples:
            return (np.zeros(0, dtype=np.intp),) * 3
        slave, point, facet = np.concatenate(triples, axis=1)
        kept = self._face_each_other(slave, facet)
        if not everywhere:
            size = np.linalg.norm(positions - centres[:, None], axis=2).max(axis=1)
            corner = positions[:, : 2 ** (self._dim - 1)]
            normal = area_vectors(_sides(corner)) * self._sign[:, None]
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            away = points[slave, point] - centres[facet]
            kept &= np.einsum("pd,pd->p", away, normal[facet]) < BULGE * size[facet]
        return slave[kept], point[kept], facet[kept]

    def _face_each_other(self, one: Index, other: Index) -> Mask:
        """Whether facets look at each other, each before the other, in the undeformed body."""
        across = self._middle[other] - self._middle[one]
        turned = np.einsum("pd,pd->p", self._normal[one], self._normal[other]) < FACING
        ahead = np.einsum("pd,pd->p", across, self._normal[one]) > 0.0
        behind = np.einsum("pd,pd->p", across, self._normal[other]) < 0.0
        return np.asarray(turned & ahead & behind)

    def _project(self, x: Array, nodes: Array) -> tuple[Array, Mask]:
        """Coordinates (P, d-1) in 0 to 1 of the facets' nearest points, and which are within.

        Newton's method on |r|^2 / 2; on the rim a coordinate is held while its slope points out.
        """
        sides = self._dim - 1
        place = np.full((len(x), sides), 0.5)
        free = np.ones_like(place, dtype=bool)
        for _ in range(PROJECTIONS):
            shape, slopes, bends = self._tabulate(place)
            apart = x - np.einsum("pa,pad->pd", shape, nodes)
            tangents = slopes @ nodes
            gradient = -np.einsum("psd,pd->ps", tangents, apart)
            out = ((place <= 0.0) & (gradient > 0.0)) | ((place >= 1.0) & (gradient < 0.0))
            free = ~out
            metric = tangents @ tangents.swapaxes(1, 2)
            curved = metric - np.einsum(
                "pstd,pd->pst", np.einsum("psta,pad->pstd", bends, nodes), apart
            )
            definite = np.linalg.det(curved) > 0.1 * np.linalg.det(metric)
            definite &= np.trace(curved, axis1=1, axis2=2) > 0.0
            hessian = np.where(definite[:, None, None], curved, metric)
            hessian, right = _held(hessian, gradient, free)
            step = -np.linalg.solve(hessian, right[..., None])[..., 0]
            following = np.clip(place + step, 0.0, 1.0)
            moved = np.abs(following - place).max(initial=0.0)
            place = following
            if moved < CONVERGED:
                break
        return place, free

    def _tabulate(self, place: Array) -> tuple[Array, Array, Array]:
        """Shape functions (P, a), first (P, d-1, a) and second derivatives (P, d-1, d-1, a)."""
        sides = self._dim - 1
        if not len(place):
            a = self._shape.shape[-1] if self._shape.ndim == 3 else 0
            return np.zeros((0, a)), np.zeros((0, sides, a)), np.zeros((0, sides, sides, a))
        table = np.array(self._element.tabulate(2, place))[..., 0]
        if sides == 1:
            return table[0], table[1][:, None], table[2][:, None, None]
        slopes = np.stack([table[1], table[2]], axis=1)  # basix: 1, x, y, xx, xy, yy
        bends = np.stack(
            [np.stack([table[3], table[4]], axis=1), np.stack([table[4], table[5]], axis=1)], axis=1
        )
        return table[0], slopes, bends

    def _second_derivatives(self, found: Pressing, nodes: Array) -> Array:
        """Of each point's energy by the nodes of both facets: (P, 2 a d, 2 a d), N/m.

        `nodes` (P, a, d) are the facing facets', m.
        """
        d, eye = self._dim, np.eye(self._dim)
        own = self._shape[found.point]
        both = np.concatenate([own, -found.shape], axis=1)  # B, (P, 2 a)
        count = both.shape[1]
        moving = np.einsum("pm,pn,ij->pminj", both, both, eye)
        later = np.concatenate(
            [np.zeros((*found.slopes.shape[:2], own.shape[1])), -found.slopes], 2
        )
        turning = np.einsum("psm,pi->psmi", later, found.apart)
        turning -= np.einsum("pm,psi->psmi", both, found.tangents)
        bent = np.einsum("psta,pad->pstd", found.bends, nodes)
        metric = found.tangents @ found.tangents.swapaxes(1, 2)
        metric = metric - np.einsum("pstd,pd->pst", bent, found.apart)
        metric, _ = _held(metric, found.apart[:, : d - 1], found.free)
        turning = np.where(found.free[..., None, None], turning, 0.0)
        flat = turning.reshape(*turning.shape[:2], count * d)
        slip = flat.swapaxes(1, 2) @ np.linalg.solve(metric, flat)
        blocks = moving.reshape(-1, count * d, count * d) - slip
        return np.asarray(self._share[found.point][:, None, None] * blocks)


def _held(matrix: Array, right: Array, free: Mask) -> tuple[Array, Array]:
    """The systems (P, s, s) with the unknowns that are not `free` (P, s) held at zero."""
    kept = free[:, :, None] & free[:, None, :]
    identity = np.eye(matrix.shape[-1])[None] * ~free[:, :, None]
    return np.where(kept, matrix, identity), np.where(free, right, 0.0)


def _sides(corners: Array) -> Array:
    """Sides (F, d-1, d) from the first of the corners (F, 2^(d-1), d)."""
    return np.asarray(corners[:, 1 : corners.shape[2]] - corners[:, :1])
