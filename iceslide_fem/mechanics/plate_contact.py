"""Frictionless penalty contact of bulging sides with the plate's plane.

The plate extends beyond the block. A side point above the plate's plane has the penetration g = z -
(H + w), with the plate's upward displacement w, and stores eps/2 g^2 per undeformed area. Forces
and tangent are the derivatives of this energy with the nodes and with w. Without this contact
rubber would pass the corner at the plate, and elements there would invert.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.mechanics.contact_surface import contact_surface
from iceslide_fem.runtime.arrays import Array, Index

DEGREE, PIECES = 5, 2
BULGE = 0.5  # of a facet's rise: no point lies farther above its highest node


class Lying(NamedTuple):
    """Facets (n,), n > 0, near the plate's plane, with data of points above it (else 0).

    The data are weights (m2; m in a slice) times shape functions (n, q, a), and heights above the
    plane (n, q), m.
    """

    facets: Index
    touching: Array
    gap: Array


class PlateContact:
    """Contact of the block's sides with the plate."""

    def __init__(self, space: Any, facets: Any, plate: Any, height: float, penalty: float) -> None:
        """Exterior `facets` (local numbers) of a vector Lagrange space; `plate`: blocked dofs on
        the plate; height of the block, m; penalty, Pa/m.
        """
        self._surface = contact_surface(space, facets, DEGREE, PIECES)
        self._comm, self._plate, self._penalty = space.mesh.comm, plate, penalty
        self._dim = space.mesh.geometry.dim
        self._height = height
        area = np.linalg.norm(self._surface.undeformed(), axis=-1)
        self._weights = np.abs(self._surface.weights) * area

    def energy(self, u: Array) -> float:
        """Energy (J; J/m in a slice) at displacements `u` (blocked dofs, d). Collective."""
        lying, squares = self._lying(u), 0.0
        if lying is not None:
            squares = float(np.sum(self._weights[lying.facets] * lying.gap**2))
        return self._sum(0.5 * self._penalty * squares)

    def add_forces(self, u: Array, vector: Array) -> float:
        """Add this rank's forces, the energy's derivative with the nodes, to `vector`.

        vector: (blocked dofs, d). Returns the force (N) on the plate from below. Collective.
        """
        lying, force = self._lying(u), 0.0
        if lying is not None:
            by_point = self._penalty * lying.touching * lying.gap[..., None]
            dofs = self._surface.dofs[lying.facets]
            np.add.at(vector[:, -1], dofs, by_point.sum(axis=1))
            force = self._penalty * float(np.sum(self._weights[lying.facets] * lying.gap))
        return self._sum(force)

    def add_tangent(self, u: Array, matrix: PETSc.Mat) -> None:
        """Add the second derivative of the energy by the nodes to `matrix`. Collective."""
        lying = self._lying(u)
        if lying is not None:
            shape = self._surface.shape[lying.facets]
            blocks = self._penalty * lying.touching.transpose(0, 2, 1) @ shape
            rows = self._surface.dofs[lying.facets] * self._dim + self._dim - 1
            for row, block in zip(rows.astype(np.int32), blocks, strict=True):
                matrix.setValuesLocal(row, row, block, PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()

    def add_lift(self, u: Array, vector: Array) -> float:
        """Add the derivative of nodal forces with the plate's upward displacement to `vector`.

        vector: (blocked dofs, d), this rank's part. Returns the derivative of the plate's force,
        N/m.
        """
        lying, covered = self._lying(u), 0.0
        if lying is not None:
            dofs = self._surface.dofs[lying.facets]
            np.add.at(vector[:, -1], dofs, -self._penalty * lying.touching.sum(axis=1))
            covered = float(np.sum(self._weights[lying.facets] * (lying.gap > 0.0)))
        return self._sum(self._penalty * covered)

    def _lying(self, u: Array) -> Lying | None:
        """Points above the plate's plane; None if this rank has none. Collective."""
        level = self._height + lift_of(self._plate, u, self._comm)
        z = self._surface.nodes[..., -1] + u[:, -1][self._surface.dofs]
        highest, lowest = z.max(axis=1), z.min(axis=1)
        facets = np.flatnonzero(highest + BULGE * (highest - lowest) > level)
        if not facets.size:
            return None
        shape = self._surface.shape[facets]
        gap = np.maximum((shape @ z[facets][..., None])[..., 0] - level, 0.0)
        touching = shape * (self._weights[facets] * (gap > 0.0))[..., None]
        return Lying(facets, touching, gap)

    def _sum(self, value: float) -> float:
        return float(self._comm.allreduce(value, op=MPI.SUM))


def lift_of(plate: Any, u: Array, comm: MPI.Comm) -> float:
    """Upward displacement (m) of the `plate`'s blocked dofs in `u` (blocked dofs, d).
    Collective.
    """
    own = float(u[plate[0], -1]) if plate.size else -np.inf
    return float(comm.allreduce(own, op=MPI.MAX))
