"""Friction of self-contact: Coulomb's law with stick points.

A point x that presses with p is tied to a material point y of the facing wall, its anchor, by a
spring of the walls' penalty eps along that wall's tangents there. With the projector P on them,

    s = P (x - y),    tau = eps s    where eps |s| <= mu p (it sticks),
                      tau = mu p s / |s|    elsewhere (it slips)

(the radial return of elastoplastic friction: P. Wriggers, Computational Contact Mechanics, 2nd ed.,
Springer 2006, sec. 10.5). Anchors are those of the last accepted equilibrium, and fixed during the
next solve. After it, anchors of slipping points follow, so that eps |s| = mu p. A point that
touches down gets an anchor at its place, without traction. A point that lifts off loses its anchor.

Shapes: P points, a nodes of a facet, d components, s = d - 1 tangents.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.mechanics.contact_surface import area_vectors
from iceslide_fem.mechanics.facing import Pressing, restricted
from iceslide_fem.runtime.arrays import Array, Index


class StickPoints(NamedTuple):
    """Stick points of the points (F, q) of all walls, the same on all ranks.

    facet: of the anchor, -1 without one; place (F, q, s): reference coordinates of the anchor;
    bound: mu p when it was set, Pa.
    """

    facet: Index
    place: Array
    bound: Array


class Stretch(NamedTuple):
    """Springs between points and their anchors.

    shape (P, a), slopes (P, s, a): shape functions at the anchors and their derivatives; apart
    (P, d): x - y, m; tangents and their duals (P, s, d); normal (P, d): unit, of either sign; along
    (P, d): the part of `apart` along the tangents, m.
    """

    shape: Array
    slopes: Array
    apart: Array
    tangents: Array
    duals: Array
    normal: Array
    along: Array


def no_stick_points(points: tuple[int, ...], sides: int) -> StickPoints:
    """Stick points of untouched walls; points: number of facets and of points on each."""
    none = np.full(points, -1, dtype=np.intp)
    return StickPoints(none, np.zeros((*points, sides)), np.zeros(points))


def stretch(x: Array, nodes: Array, shape: Array, slopes: Array) -> Stretch:
    """Springs from points `x` (P, d), m, to anchors.

    shape, slopes: shape functions at the anchors; nodes: deformed, of the anchors' facets (P, a,
    d), m.
    """
    apart = x - np.einsum("pa,pad->pd", shape, nodes)
    tangents = slopes @ nodes
    duals = np.asarray(np.linalg.solve(tangents @ tangents.swapaxes(1, 2), tangents))
    normal = area_vectors(tangents)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = apart - np.einsum("pd,pd->p", apart, normal)[:, None] * normal
    return Stretch(shape, slopes, apart, tangents, duals, normal, along)


def tractions(along: Array, bound: Array, penalty: float) -> Array:
    """tau (P, d), Pa, of springs with stretch `along` (P, d), m, and bounds mu p (P,), Pa."""
    drawn = penalty * np.linalg.norm(along, axis=1)
    fraction = np.divide(bound, drawn, out=np.ones_like(drawn), where=drawn > bound)
    return np.asarray((fraction * penalty)[:, None] * along)


def slip(along: Array, bound: Array, penalty: float) -> Array:
    """Slip of the anchors (P,), m."""
    return np.maximum(np.linalg.norm(along, axis=1) - bound / penalty, 0.0)


def slopes_of_tractions(springs: Stretch, bound: Array, penalty: float) -> tuple[Array, Array]:
    """Derivatives of `tractions`: with `along` (P, d, d), Pa/m, and with the bound (P, d)."""
    length = np.linalg.norm(springs.along, axis=1)
    slips = penalty * length > bound
    safe = np.where(slips, length, 1.0)
    direction = np.where(slips[:, None], springs.along / safe[:, None], 0.0)
    strength = np.where(slips, bound / safe, penalty)
    across = np.eye(direction.shape[1]) - direction[:, :, None] * direction[:, None, :]
    return strength[:, None, None] * across, direction


def slopes_of_along(springs: Stretch) -> tuple[Array, Array]:
    """Derivatives of `along` by the point x (P, d, d), and by the anchor's nodes (P, d, a, d).

    With the unit normal n, the duals t^a and the anchor's tangents t_a:
    ds = P dx - P dy + (r . n) t^a (n . dt_a) + n (t^a . r) (n . dt_a).
    """
    normal = springs.normal
    by_point = np.eye(normal.shape[1]) - normal[:, :, None] * normal[:, None, :]
    by_nodes = -np.einsum("pij,pa->piaj", by_point, springs.shape)
    above = np.einsum("pd,pd->p", springs.apart, normal)
    beside = np.einsum("psd,pd->ps", springs.duals, springs.apart)
    turned = above[:, None, None] * springs.duals + beside[:, :, None] * normal[:, None, :]
    by_nodes += np.einsum("psi,psa,pj->piaj", turned, springs.slopes, normal)
    return by_point, by_nodes


class Sticking(NamedTuple):
    """Points in contact with an anchor: contact, anchor facets (P,), springs, bounds mu p
    (P,), Pa.
    """

    pressing: Pressing
    facet: Index
    springs: Stretch
    bound: Array


def pressing_stiffness(found: Pressing, own: Array, nodes: Array) -> Array:
    """Second derivatives of r . r / 2 of each point, (P, 2 a d, 2 a d).

    They are with the nodes of the point's facet and of the facing facet.

    own: the point's shape functions (P, a); nodes (P, a, d): of the facing facets, m.
    """
    dim = nodes.shape[-1]
    both = np.concatenate([own, -found.shape], axis=1)  # B, (P, 2 a)
    size = both.shape[1] * dim
    moving = np.einsum("pm,pn,ij->pminj", both, both, np.eye(dim))
    later = np.concatenate([np.zeros((*found.slopes.shape[:2], own.shape[1])), -found.slopes], 2)
    turning = np.einsum("psm,pi->psmi", later, found.apart)
    turning -= np.einsum("pm,psi->psmi", both, found.tangents)
    bent = np.einsum("psta,pad->pstd", found.bends, nodes)
    metric = found.tangents @ found.tangents.swapaxes(1, 2)
    metric = restricted(metric - np.einsum("pstd,pd->pst", bent, found.apart), found.ways)
    flat = found.ways @ turning.reshape(*turning.shape[:2], size)
    slip = flat.swapaxes(1, 2) @ np.linalg.solve(metric, flat)
    blocks = moving.reshape(-1, size, size) - slip
    return np.asarray(blocks)


def friction_stiffness(sticking: Sticking, own: Array, penalty: float, friction: float) -> Array:
    """Derivatives of each point's friction traction with nodal positions, (P, 3 a d, 3 a d), Pa/m.

    Nodes are those of the point's, the facing and the anchor's facet.

    own: the point's shape functions (P, a); penalty, Pa/m; friction coefficient.
    """
    found, springs = sticking.pressing, sticking.springs
    dim = found.apart.shape[-1]
    none = np.zeros_like(own)
    held = np.concatenate([own, none, -springs.shape], axis=1)  # nodes on which the traction acts
    by_point, by_anchor = slopes_of_along(springs)
    by_own = np.einsum("pij,pa->piaj", by_point, own)
    along = np.concatenate([by_own, np.zeros_like(by_own), by_anchor], axis=2)
    by_along, by_bound = slopes_of_tractions(springs, sticking.bound, penalty)
    slopes = np.einsum("pij,pjmk->pimk", by_along, along)
    pressing = np.concatenate([own, -found.shape, none], axis=1)
    normal = found.apart / np.linalg.norm(found.apart, axis=1, keepdims=True)
    stiffness = friction * penalty
    slopes += stiffness * np.einsum("pi,pm,pk->pimk", by_bound, pressing, normal)
    size = held.shape[1] * dim
    return np.einsum("pn,pimk->pnimk", held, slopes).reshape(-1, size, size)
