"""Self-contact: penalty contact with friction between facing walls of sipes and grooves.

A point x that penetrates a facing wall by the distance e = |r|, r = x - y with the wall's nearest
point y, stores the energy eps / 4 e^2 per undeformed area. Each wall is once the slave and once the
master (two half passes, R. A. Sauer and L. De Lorenzis, Int. J. Numer. Meth. Engng 101 (2015) 251),
so the pressure between them is eps e.

Forces and tangent are the derivatives of that energy. With r = B u + const, B of the point's and
the nearest point's shape functions, and y found from t_a . r = 0 (its tangents t_a),

    force = k B^T r,  tangent = k (B^T B - G_a M_ab^-1 G_b^T),
    M_ab = t_a . t_b - r . y_,ab,  G_a = -B^T t_a + (dB/dxi_a)^T r

(`self_contact_stiffness`), without the second part where y lies on a facet's rim. Friction
(`self_contact_friction`) adds half its traction to the point's force, and the opposite one to its
stick point. Walls are small, so every rank holds all of them and computes all of their contact. It
keeps the forces on its own nodes.

Shapes: F facets, q points each, a nodes, d components; P points in contact (`facing`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import PETSc
from iceslide_fem.mechanics.contact_surface import FACET_OF, contact_surface, space_degree
from iceslide_fem.mechanics.facing import Facets, FacingWalls, Pressing
from iceslide_fem.mechanics.self_contact_friction import (
    Sticking,
    StickPoints,
    friction_stiffness,
    no_stick_points,
    pressing_stiffness,
    slip,
    stretch,
    tractions,
)
from iceslide_fem.runtime.arrays import Array, Index

DEGREE = 5  # of the quadrature on a facet


class SelfContact:
    """All walls of a body that may meet, known to every rank.

    dofs: of the nodes of this rank's facets (blocked, local); unknowns: global numbers of the
    displacements of all walls; own: mask of this rank's unknowns, whose numbers begin at
    `unknowns_before`.

    stick_points: those of the last accepted equilibrium, None without friction. After acceptance
    the caller sets them to the result of `followed`.
    """

    def __init__(self, space: Any, facets: Any, penalty: float, friction: float = 0.0) -> None:
        """The exterior `facets` (local numbers) of a vector Lagrange space; penalty, Pa/m; friction
        coefficient.

        Collective.
        """
        mesh = space.mesh
        kind = FACET_OF[compat.cell_name(mesh)]
        self.own_facets = contact_surface(space, facets, DEGREE)
        self._comm, self._dim = mesh.comm, mesh.geometry.dim
        index_map = space.dofmap.index_map
        self._first, self._last = index_map.local_range
        dofs = index_map.local_to_global(self.own_facets.dofs.ravel()).reshape(
            self.own_facets.dofs.shape
        )
        self.dofs = self.own_facets.dofs
        self._dofs = self._gather(dofs)
        nodes, numbers = np.unique(self._dofs, return_inverse=True)
        self._numbers = numbers.reshape(self._dofs.shape)
        self.unknowns = (nodes[:, None] * self._dim + np.arange(self._dim)).ravel()
        self.unknowns_before = self._first * self._dim
        self.own = np.repeat((self._first <= nodes) & (nodes < self._last), self._dim)
        normals = self.own_facets.undeformed()
        outwards = self._gather(
            (normals * np.sign(self.own_facets.weights)[..., None]).mean(axis=1)
        )
        self._facets = Facets(
            kind,
            compat.basix_lagrange(kind, space_degree(space)),
            self._gather(self.own_facets.nodes),
            self._gather(self.own_facets.shape),
            outwards / np.linalg.norm(outwards, axis=-1, keepdims=True),
            self._gather(np.sign(self.own_facets.weights))[:, 0],
        )
        self._facing = FacingWalls(self._facets)
        counts = self._comm.allgather(len(self.own_facets.dofs))
        first = sum(counts[: self._comm.rank])
        self._mine = slice(first, first + len(self.own_facets.dofs))
        area = np.linalg.norm(normals, axis=-1)
        self.half_area = 0.5 * self._gather(np.abs(self.own_facets.weights) * area)
        self.penalty, self._friction = penalty, friction
        self._found = self._facets.nodes, self._inside(self._facets.nodes)
        self.stick_points: StickPoints | None = None
        if friction > 0.0:
            self.stick_points = no_stick_points(self.half_area.shape, self._dim - 1)

    @property
    def count(self) -> int:
        """Number of facets on all ranks."""
        return len(self._dofs)

    def energy(self, u: Array) -> float:
        """Energy (J; J/m in a slice) of penetration and friction springs at `u`. Collective.

        u: displacements (blocked dofs, d).
        """
        positions = self.deformed(u)
        found = self.pressing_at(positions)
        area = self.half_area[found.point]
        energy = 0.5 * self.penalty * np.sum(area * (found.apart**2).sum(axis=1))
        if (sticking := self.sticking_at(found, positions)) is not None:
            traction = tractions(sticking.springs.along, sticking.bound, self.penalty)
            area = self.half_area[sticking.pressing.point]
            energy += 0.5 / self.penalty * np.sum(area * (traction**2).sum(axis=1))
        return float(energy)

    def add_forces(self, u: Array, vector: Array) -> None:
        """Add the contact forces on this rank's nodes to `vector` (blocked dofs, d). Collective.

        Without friction they are the derivative of the energy.
        """
        positions = self.deformed(u)
        found = self.pressing_at(positions)
        self._add(vector, found, self.penalty * found.apart, found.facet, found.shape)
        if (sticking := self.sticking_at(found, positions)) is not None:
            springs = sticking.springs
            traction = tractions(springs.along, sticking.bound, self.penalty)
            self._add(vector, sticking.pressing, traction, sticking.facet, springs.shape)

    def add_tangent(self, stiffness: csr_matrix, matrix: PETSc.Mat) -> None:
        """Add a `stiffness`, as `SelfContact.stiffness`, to this rank's rows of `matrix`.
        Collective.
        """
        if not stiffness.nnz:  # on every rank
            return
        dofs = self.unknowns.astype(PETSc.IntType)
        for row in np.flatnonzero(self.own):
            entries = slice(*stiffness.indptr[row : row + 2])
            columns = dofs[stiffness.indices[entries]]
            matrix.setValues(
                dofs[row], columns, stiffness.data[entries], PETSc.InsertMode.ADD_VALUES
            )
        matrix.assemble()

    def stiffness(self, u: Array) -> csr_matrix:
        """Derivative of the forces with the `unknowns`, N/m, equal on all ranks. Collective."""
        positions = self.deformed(u)
        found = self.pressing_at(positions)
        facets, own = [found.point[0], found.facet], self._facets.shape[found.point]
        blocks = pressing_stiffness(found, own, positions[found.facet])
        area = self.half_area[found.point][:, None, None]
        parts = [self._entries(facets, self.penalty * area * blocks)]
        if (sticking := self.sticking_at(found, positions)) is not None:
            pressing = sticking.pressing
            facets = [pressing.point[0], pressing.facet, sticking.facet]
            own, area = (part[pressing.point] for part in (self._facets.shape, self.half_area))
            blocks = friction_stiffness(sticking, own, self.penalty, self._friction)
            parts.append(self._entries(facets, area[:, None, None] * blocks))
        values, rows, columns = (np.concatenate(part) for part in zip(*parts, strict=True))
        size = len(self.unknowns)
        return coo_matrix((values, (rows, columns)), shape=(size, size)).tocsr()

    def followed(self, u: Array) -> tuple[StickPoints | None, float]:
        """Stick points if `u` is accepted, and the heat (J; J/m) of the slip. Collective.

        The heat is the mean of mu p at both ends times the distance that stick points move. Without
        friction the result is None and 0.
        """
        if self.stick_points is None:
            return None, 0.0
        positions = self.deformed(u)
        found = self.pressing_at(positions)
        targets = self._points(positions)
        stick_points = no_stick_points(self.half_area.shape, self._dim - 1)
        stick_points.bound[found.point] = self._friction * self._pressure(found)
        sticks = np.zeros(stick_points.facet.shape, dtype=bool)
        heat = 0.0
        if (sticking := self.sticking_at(found, positions)) is not None:
            springs, point = sticking.springs, sticking.pressing.point
            traction = tractions(springs.along, sticking.bound, self.penalty)
            slipped = slip(springs.along, sticking.bound, self.penalty)
            mean = 0.5 * (sticking.bound + self.stick_points.bound[point])
            heat = float(np.sum(self.half_area[point] * mean * slipped))
            targets[point] -= traction / self.penalty
            sticks[point] = slipped == 0.0
        pressing = np.zeros_like(sticks)
        pressing[found.point] = True
        anchors = self._facing.nearest(positions, targets, everywhere=False)
        anchors = anchors.chosen((pressing & ~sticks)[anchors.point])
        stick_points.facet[anchors.point], stick_points.place[anchors.point] = (
            anchors.facet,
            anchors.place,
        )
        stick_points.facet[sticks], stick_points.place[sticks] = (
            self.stick_points.facet[sticks],
            self.stick_points.place[sticks],
        )
        return stick_points, heat

    def smallest_opening(self, u: Array, below: float) -> float:
        """Smallest distance of a wall point from a facing wall, m. Collective.

        Negative for penetration. Of open walls it is infinite if it is not `below` that.
        """
        positions = self.deformed(u)
        inside = self.pressing_at(positions).opening
        if inside.size:
            return float(inside.min())
        return self._facing.smallest_opening(positions, self._points(positions), below)

    def pressure(self, u: Array) -> tuple[Array, Array]:
        """Positions (n, d), m, of points in contact, and their pressures (n,), Pa. Collective.

        Pressures are per undeformed area. Each wall has its own points.
        """
        positions = self.deformed(u)
        found = self.pressing_at(positions)
        return self._points(positions)[found.point], self._pressure(found)

    @property
    def points(self) -> Array:
        """Undeformed positions (n, d) of the points of this rank's facets, m."""
        return (self.own_facets.shape @ self.own_facets.nodes).reshape(-1, self._dim)

    def saved(self, stick_points: StickPoints) -> dict[str, Array]:
        """Stick points of this rank's `points`, independent of facet numbers.

        They are: undeformed positions of the anchors (d, n), m; whether there is one (n,), 1 or 0;
        bounds (n,), Pa.
        """
        shape, _, _ = self._facets.tabulate(stick_points.place.reshape(-1, self._dim - 1))
        nodes = self._facets.nodes[stick_points.facet.ravel()]
        anchors = np.einsum("pa,pad->pd", shape, nodes).reshape(
            *stick_points.facet.shape, self._dim
        )
        own = self._mine
        return {
            "anchor": anchors[own].reshape(-1, self._dim).T,
            "gripped": (stick_points.facet[own] >= 0).ravel().astype(np.float64),
            "bound": stick_points.bound[own].ravel(),
        }

    def restored(self, saved: Mapping[str, Array]) -> StickPoints:
        """Stick points from this rank's part of `saved`. Collective."""
        own = self.own_facets.shape.shape[:2]
        anchors = self._gather(saved["anchor"].T.reshape(*own, self._dim))
        sticking = self._gather(saved["gripped"].reshape(own)) > 0.0
        found = self._facing.nearest(self._facets.nodes, anchors, everywhere=True)
        found = found.chosen(sticking[found.point])
        stick_points = no_stick_points(sticking.shape, self._dim - 1)
        stick_points.facet[found.point], stick_points.place[found.point] = found.facet, found.place
        stick_points.bound[:] = self._gather(saved["bound"].reshape(own))
        return stick_points

    def _gather(self, values: Array) -> Any:
        """Arrays (F, ...) of all ranks' facets. Collective."""
        parts = [part for part in self._comm.allgather(values) if len(part)]
        return np.concatenate(parts) if parts else values

    def deformed(self, u: Array) -> Array:
        """Deformed nodes (F, a, d) of all walls, m. Collective."""
        return np.asarray(self._facets.nodes + self._gather(u[self.own_facets.dofs]))

    def _points(self, positions: Array) -> Array:
        """Deformed points (F, q, d), m."""
        return np.asarray(self._facets.shape @ positions)

    def pressing_at(self, positions: Array) -> Pressing:
        """Points that penetrate a facing wall."""
        if not np.array_equal(positions, self._found[0]):  # cached for the tangent
            self._found = positions, self._inside(positions)
        return self._found[1]

    def _inside(self, positions: Array) -> Pressing:
        found = self._facing.nearest(positions, self._points(positions), everywhere=False)
        return found.chosen(found.opening < 0.0)

    def _pressure(self, found: Pressing) -> Array:
        """Pressure of points in contact (P,), Pa."""
        return np.asarray(self.penalty * np.linalg.norm(found.apart, axis=1))

    def sticking_at(self, found: Pressing, positions: Array) -> Sticking | None:
        """Points in contact that have an anchor; None without friction."""
        if self.stick_points is None:
            return None
        found = found.chosen(self.stick_points.facet[found.point] >= 0)
        facet = self.stick_points.facet[found.point]
        shape, slopes, _ = self._facets.tabulate(self.stick_points.place[found.point])
        x = found.apart + np.einsum("pa,pad->pd", found.shape, positions[found.facet])
        springs = stretch(x, positions[facet], shape, slopes)
        return Sticking(found, facet, springs, self._friction * self._pressure(found))

    def _add(
        self, vector: Array, found: Pressing, traction: Array, facet: Index, shape: Array
    ) -> None:
        """Add half of a traction (P, d), Pa, to the nodal forces, and its opposite to the other
        side.

        The other side is given by its facets and shape functions.
        """
        pull = self.half_area[found.point][:, None] * traction
        for dofs, by_node in (
            (self._dofs[found.point[0]], self._facets.shape[found.point]),
            (self._dofs[facet], -shape),
        ):
            own = (self._first <= dofs) & (dofs < self._last)
            forces = by_node[..., None] * pull[:, None, :]
            np.add.at(vector, dofs[own] - self._first, forces[own])

    def _entries(self, facets: Sequence[Index], blocks: Array) -> tuple[Array, Index, Index]:
        """Values, rows and columns of blocks (P, m d, m d) for the nodes of `facets` (P,)."""
        numbers = np.concatenate([self._numbers[facet] for facet in facets], axis=1)
        unknowns = (numbers[:, :, None] * self._dim + np.arange(self._dim)).reshape(
            len(numbers), numbers.shape[1] * self._dim
        )
        rows, columns = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
        return blocks.ravel(), rows.ravel(), columns.ravel()
