"""The rubber's contact surface: quadrature on its facets, evaluated in NumPy.

Facets belong to the rank that owns their cell, so every point exists once. A rank may have none.
Shapes: f facets or parts of them, q points on each, a nodes per facet, d = 2 or 3 components (z
last).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, basix
from iceslide_fem.runtime.arrays import Array

# Number of entries of `pairs` of all facets up to which one product is faster than one per kind.
FEW = 100_000
FACET_OF = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}


@dataclass(frozen=True)
class ContactSurface:
    """Quadrature on facets of a vector Lagrange space.

    dofs: blocked dofs (f, a); nodes: undeformed positions (f, a, d), m; shape: (f, q, a);
    slopes: derivatives of the shape functions by the facet's coordinates (f, q, d-1, a);
    weights: reference weights, with the sign that makes area vectors point outwards (f, q); whole:
    number of the whole facet on this rank to which a part belongs, (f,). Parts of one kind (f,)
    have the same shape and slopes; pairs: per kind, products of the shape functions with themselves
    and with the slopes, (kinds, d q, a a).
    """

    dofs: NDArray[np.int32]
    nodes: Array
    shape: Array
    slopes: Array
    weights: Array
    whole: NDArray[np.intp]
    kind: NDArray[np.intp]
    pairs: Array
    comm: MPI.Comm

    @property
    def n_points(self) -> int:
        """Points on this rank."""
        return int(self.weights.size)

    @cached_property
    def firsts(self) -> NDArray[np.intp]:
        """First part of each whole facet, (facets,)."""
        return np.flatnonzero(np.diff(self.whole, prepend=-1))

    def of(self, facets: NDArray[np.intp]) -> ContactSurface:
        """The part of the surface on some of this rank's facets."""
        return ContactSurface(
            self.dofs[facets],
            self.nodes[facets],
            self.shape[facets],
            self.slopes[facets],
            self.weights[facets],
            self.whole[facets],
            self.kind[facets],
            self.pairs,
            self.comm,
        )

    def positions(self, u: Array) -> Array:
        """Deformed positions (f, q, d) for nodal displacements `u` (blocked dofs, d), m."""
        return np.asarray(self.shape @ (self.nodes + u[self.dofs]))

    def heights(self, u: Array) -> Array:
        """Deformed positions' vertical component (f, q), m."""
        z = self.nodes[..., -1] + u[:, -1][self.dofs]
        return np.asarray((self.shape @ z[..., None])[..., 0])

    def displacements(self, u: Array) -> Array:
        """Displacements of the points (f, q, d), m."""
        return np.asarray(self.shape @ u[self.dofs])

    def footprint(self, u: Array) -> Array:
        """Area that each point covers on the plane of the ice, (f, q), m2 (m in a slice).

        It is the component of the deformed area vector towards the ice, at least 0: vertical and
        upward facets cover nothing. n da = J F^-T N dA (Nanson), from the tangents.
        """
        if self.nodes.shape[-1] == 2:  # along x alone
            x = self.nodes[..., 0] + u[:, 0][self.dofs]
            along = (self.slopes[:, :, 0] @ x[..., None])[..., 0]
            return np.maximum(self.weights * along, 0.0)
        return np.maximum(self._signed_footprint(self.tangents(u)), 0.0)

    def footprint_slopes(self, u: Array) -> Array:
        """Derivative of `footprint` by the `tangents`, (f, q, d-1, d), m (1 in a slice)."""
        tangents, weights = self.tangents(u), self.weights
        by_tangent = np.zeros_like(tangents)
        if tangents.shape[2] == 1:
            by_tangent[:, :, 0, 0] = weights
        else:
            (x1, y1), (x2, y2) = np.moveaxis(tangents[..., :2], (2, 3), (0, 1))
            by_tangent[:, :, 0, 0], by_tangent[:, :, 0, 1] = -weights * y2, weights * x2
            by_tangent[:, :, 1, 0], by_tangent[:, :, 1, 1] = weights * y1, -weights * x1
        by_tangent[self._signed_footprint(tangents) <= 0.0] = 0.0
        return by_tangent

    def summed_pairs(self, moving: Array, turning: Array) -> Array:
        """Sums over the points, (f, a, i, a, j): of s_a m_ij s_b, which `moving` (f, q, i, j) has,
        and of s_a t_kij ds_b/dk, which `turning` (f, q, d-1, i, j) has, k the facet's coordinates.
        """
        f, q, rows, columns = moving.shape
        both = np.concatenate([moving[:, :, None], turning], axis=2).transpose(0, 3, 4, 2, 1)
        both = both.reshape(f, rows * columns, self.pairs.shape[1])
        if f * self.pairs[:1].size <= FEW:
            sums = both @ self.pairs[self.kind]
        else:
            sums = np.empty((f, rows * columns, self.pairs.shape[-1]))
            for kind in np.unique(self.kind):
                here = self.kind == kind
                sums[here] = np.tensordot(both[here], self.pairs[kind], 1)
        nodes = self.shape.shape[-1]
        return sums.reshape(f, rows, columns, nodes, nodes).transpose(0, 3, 1, 4, 2)

    def undeformed(self) -> Array:
        """Area vectors of the undeformed facets at the points, for weight 1, (f, q, d)."""
        return area_vectors(_tangents(self.slopes, self.nodes))

    def tangents(self, u: Array) -> Array:
        """Derivatives of the deformed positions by the facet's coordinates (f, q, d-1, d), m."""
        return _tangents(self.slopes, self.nodes + u[self.dofs])

    def _signed_footprint(self, tangents: Array) -> Array:
        if tangents.shape[2] == 1:
            return np.asarray(self.weights * tangents[:, :, 0, 0])
        (x1, y1), (x2, y2) = np.moveaxis(tangents[..., :2], (2, 3), (0, 1))
        return np.asarray(-self.weights * (x1 * y2 - y1 * x2))

    def scatter(self, forces: Array, vector: Array) -> None:
        """Add nodal forces (f, a, d) to `vector` (blocked dofs, d), ghosts included, in place."""
        np.add.at(vector, self.dofs, forces)

    def total(self, density: Array, area: Array) -> float:
        """Integral over all ranks of `density` (f, q) with the weights `area` (f, q)."""
        return float(self.comm.allreduce(float(np.sum(density * area)), op=MPI.SUM))


def contact_surface(
    space: Any,
    facets: NDArray[np.int32],
    degree: int,
    pieces: int = 1,
    along: int = 0,
    longest: float = np.inf,
    across: int | None = None,
) -> ContactSurface:
    """Quadrature of polynomial `degree` on the exterior `facets` (local numbers) of `space`.

    Edges and quadrilaterals are cut into `pieces` per direction, each with its rule. Functions with
    kinks at the cuts are then integrated exactly. Triangles are not cut. `across`, if given, is the
    degree along the sides that run least along x. `along` is the number of Gauss points on the
    sides that run most along x (triangles: both directions). These sides are cut into equal parts
    no longer than `longest` (m).

    `space` is a vector Lagrange space of degree 1 or 2 on a mesh of linear geometry.
    """
    mesh = space.mesh
    dim = mesh.topology.dim
    name = compat.cell_name(mesh)
    element = compat.basix_lagrange(name, space_degree(space))
    cells, local = compat.facet_cell_pairs(mesh, facets)

    line = _line(2 * along - 1, 1) if along else _line(degree, pieces)
    if FACET_OF[name] == "triangle":
        points, facet_weights = compat.quadrature("triangle", max(degree, 2 * along - 1))
        longest = np.inf
    else:
        beside = _line(degree if across is None else across, pieces)
        points, facet_weights = _product([line, beside][: dim - 1])
    closures = np.array(element.entity_closure_dofs[dim - 1], dtype=np.intp)
    coordinates = space.tabulate_dof_coordinates()[:, :dim]
    dofs_of_cells = compat.cell_dofs(space)[cells]
    dofs = np.take_along_axis(dofs_of_cells, closures[local], axis=1)
    nodes = coordinates[dofs]
    # The first nodes are the vertices. Sides start at vertex 0.
    sides = np.abs(nodes[:, 1:dim, 0] - nodes[:, :1, 0])
    turned = sides[:, -1] > sides[:, 0]
    parts = np.maximum(np.ceil(sides.max(axis=1) / longest), 1.0).astype(np.intp)
    whole = np.repeat(np.arange(len(cells)), parts)
    part = np.arange(whole.size) - np.repeat(np.cumsum(parts) - parts, parts)

    cell_type = getattr(basix.CellType, name)
    reference, facet_vertices = np.asarray(basix.geometry(cell_type)), basix.topology(cell_type)
    kinds = np.stack([local[whole], turned[whole], parts[whole], part], axis=1)
    kinds, kind = np.unique(kinds, axis=0, return_inverse=True)
    n_nodes = closures.shape[1]
    shapes = np.zeros((len(kinds), len(points), n_nodes))
    slopes = np.zeros((len(kinds), len(points), dim - 1, n_nodes))
    for at, (number, swapped, count, first) in enumerate(kinds):
        vertices = facet_vertices[dim - 1][number]
        origin = reference[vertices[0]]
        axes = np.array([reference[v] - origin for v in vertices[1:dim]])
        here = np.concatenate([(points[:, :1] + first) / count, points[:, 1:]], axis=1)
        here = origin + (here[:, ::-1] if swapped else here) @ axes
        table = np.array(element.tabulate(1, here))[..., 0][..., closures[number]]
        shapes[at], slopes[at] = table[0], np.einsum("sd,dqa->qsa", axes, table[1:])

    kind = kind.reshape(-1).astype(np.intp)  # NumPy 2.0 returns two dimensions
    seconds = np.concatenate([shapes[:, None], slopes.transpose(0, 2, 1, 3)], axis=1)
    pairs = shapes[:, None, :, :, None] * seconds[:, :, :, None, :]
    outwards = nodes.mean(axis=1) - coordinates[dofs_of_cells].mean(axis=1)
    vectors = area_vectors(_tangents(slopes[kind], nodes[whole]))
    sign = np.sign(np.einsum("fqd,fd->fq", vectors, outwards[whole]))
    return ContactSurface(
        dofs[whole],
        nodes[whole],
        shapes[kind],
        slopes[kind],
        facet_weights * sign / parts[whole, None],
        whole,
        kind,
        pairs.reshape(len(kinds), dim * len(points), n_nodes * n_nodes),
        mesh.comm,
    )


def space_degree(space: Any) -> int:
    """Polynomial degree of a Lagrange space."""
    element = space.ufl_element()
    degree = element.degree() if callable(element.degree) else element.degree
    return int(degree)


def _tangents(slopes: Array, nodes: Array) -> Array:
    """Derivatives of positions by the facet's coordinates (f, q, d-1, d) for nodes (f, a, d)."""
    f, q, sides, a = slopes.shape
    flat = slopes.reshape(f, q * sides, a) @ nodes
    return np.asarray(flat).reshape(f, q, sides, nodes.shape[-1])


def area_vectors(tangents: Array) -> Array:
    """Vectors (..., d) normal to tangents (..., d-1, d), as long as the area they span."""
    if tangents.shape[-2] == 1:
        along = tangents[..., 0, :]
        return np.stack([along[..., 1], -along[..., 0]], axis=-1)
    return np.asarray(np.cross(tangents[..., 0, :], tangents[..., 1, :]))


def _line(degree: int, pieces: int) -> tuple[Array, Array]:
    """Points and weights (n,) of the rule on `pieces` parts of a unit interval."""
    points, weights = compat.quadrature("interval", degree)
    return (np.arange(pieces)[:, None] + points[:, 0]).ravel() / pieces, np.tile(
        weights, pieces
    ) / pieces


def _product(lines: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Points (n, sides) and weights (n,) of the tensor product of rules on lines."""
    points = np.meshgrid(*[line[0] for line in lines], indexing="ij")
    weights = np.meshgrid(*[line[1] for line in lines], indexing="ij")
    return np.stack(points, axis=-1).reshape(-1, len(lines)), np.prod(weights, axis=0).ravel()
