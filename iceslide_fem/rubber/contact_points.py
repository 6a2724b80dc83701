"""Quadrature points at which the block may touch the ice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mesh.ice import window_cell
from iceslide_fem.mesh.profile import CONTACT_HEIGHT
from iceslide_fem.mesh.rubber import rounded
from iceslide_fem.rubber.contact_surface import ContactSurface, contact_surface
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody
from iceslide_fem.scene import Scene

# Gauss points in the halves of each facet; ice cells end at the halves. A block with a flat bottom
# has fewer points across the sliding direction, as many as 5 bar need
# (docs/validation/accuracy.md).
FACET_DEGREE, FACET_PIECES = 7, 2
ACROSS_DEGREE, FLAT = 5, 1e-6
# On sliding ice: number of rubber points per number of ice cells, along x.
POINTS, CELLS = 6, 2.0


def contact_points(scene: Scene, rubber: HyperelasticBody, height: float) -> ContactSurface:
    """Points at which the `rubber`, a block of this `height` (m), may touch ice. Collective."""
    facets = _facets_near_ice(rubber, height)
    passes = scene.ice.motion == "sliding"
    along, longest = (POINTS, CELLS * window_cell(scene)) if passes else (0, np.inf)
    across = ACROSS_DEGREE if _is_flat(rubber, facets) else FACET_DEGREE
    surface = contact_surface(
        rubber.space, facets, FACET_DEGREE, FACET_PIECES, along, longest, across
    )
    return replace(surface, nodes=rounded(scene, surface.nodes))


def _facets_near_ice(rubber: HyperelasticBody, height: float) -> NDArray[np.int32]:
    """Local numbers of facets that may touch ice: `contact`, and lower `walls` that fold onto
    it.
    """
    walls = rubber.facets("walls")
    if not len(walls):
        return rubber.facets("contact")
    middles = compat.midpoints(rubber.mesh, walls)
    low = walls[middles[:, rubber.mesh.geometry.dim - 1] < CONTACT_HEIGHT * height]
    return np.sort(np.concatenate([rubber.facets("contact"), low]))


def _is_flat(rubber: HyperelasticBody, facets: NDArray[np.int32]) -> bool:
    """Whether all `facets` are horizontal or vertical (no round edges). Collective."""
    normals = contact_surface(rubber.space, facets, 1).undeformed()
    up = np.abs(normals[..., -1]) / np.linalg.norm(normals, axis=-1)
    inclined = bool(((up > FLAT) & (up < 1.0 - FLAT)).any())
    return not rubber.mesh.comm.allreduce(inclined, op=MPI.LOR)
