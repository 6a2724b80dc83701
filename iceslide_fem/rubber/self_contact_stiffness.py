"""Stiffness of self-contact and its friction, per point, with the nodes of its facets.

Formulas and shapes are those of `self_contact`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.rubber.facing import Pressing, restricted
from iceslide_fem.rubber.self_contact_friction import Stretch, slopes_of_along, slopes_of_tractions
from iceslide_fem.runtime.arrays import Array, Index


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
