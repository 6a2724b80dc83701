"""Unilateral contact with the plane of the ice by penalty, and the tangential tractions on it.

The ice is the plane z = 0, so the gap is the z of the deformed surface. All functions are local
to quadrature points; `contact_forces` turns tractions into nodal forces and their tangent.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.contact_surface import ContactSurface, contact_surface
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mesh.ice import window_cell
from iceslide_fem.mesh.profile import CONTACT_HEIGHT
from iceslide_fem.mesh.rubber import rounded
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.scene.materials import MooneyRivlin

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


# Penetration over the block's mean deformation: a fraction of the scene's tolerance, within bounds.
# A softer penalty is hardly cheaper, a stiffer one hardly more accurate
# (docs/validation/accuracy.md).
PENETRATION_SHARE, PENETRATION = 0.1, (1e-3, 1e-2)


class Traction(NamedTuple):
    """Tangential traction on the rubber and its derivatives at the points.

    value: (f, q, d-1), Pa; by_pressure: (f, q, d-1); by_displacement: (f, q, d-1, d-1), Pa/m.
    """

    value: Array
    by_pressure: Array
    by_displacement: Array


def normal_pressure(gap: Array, penalty: float) -> Array:
    """Contact pressure p = eps <-g> (Pa) for the gap (m) and the penalty eps (Pa/m)."""
    return penalty * np.maximum(-gap, 0.0)


def static_friction(
    pressure: Array, displacement: Array, coefficient: float, length: float
) -> Traction:
    """Coulomb friction against the tangential displacement, regularised over `length`.

    t = -mu p u / sqrt(|u|^2 + length^2) with the tangential displacement u (f, q, d-1), m.
    """
    u = displacement
    size = np.sqrt((u**2).sum(axis=-1, keepdims=True) + length**2)
    direction = u / size
    identity = np.eye(u.shape[-1])
    slope = (identity - direction[..., :, None] * direction[..., None, :]) / size[..., None]
    strength = coefficient * pressure[..., None]
    return Traction(-strength * direction, -coefficient * direction, -strength[..., None] * slope)


def sliding_friction(shear: Array, by_pressure: Array, components: int) -> Traction:
    """Traction of a shear stress (f, q) on the rubber, against the sliding direction +x."""
    value = np.zeros((*shear.shape, components))
    slope = np.zeros_like(value)
    value[..., 0], slope[..., 0] = -shear, -by_pressure
    return Traction(value, slope, np.zeros((*shear.shape, components, components)))


def blend(first: Traction, second: Traction, fraction: float) -> Traction:
    """(1 - fraction) * first + fraction * second."""
    return Traction(
        *((1.0 - fraction) * a + fraction * b for a, b in zip(first, second, strict=True))
    )


class ContactState(NamedTuple):
    """Contact at a displacement: gap (m), pressure (Pa), covered area (m2), all (f, q)."""

    gap: Array
    pressure: Array
    area: Array


def contact_state(surface: ContactSurface, u: Array, penalty: float) -> ContactState:
    """Gap, pressure and area at the points for nodal displacements `u` (blocked dofs, d)."""
    gap = surface.heights(u)
    return ContactState(gap, normal_pressure(gap, penalty), surface.footprint(u))


def contact_forces(surface: ContactSurface, state: ContactState, traction: Traction) -> Array:
    """Nodal forces (f, a, d), N (N/m in a slice), of pressure and tangential traction."""
    forces = np.zeros((*surface.dofs.shape, traction.value.shape[-1] + 1))
    here = _loaded(state, traction)
    stress = np.concatenate([traction.value[here], state.pressure[here][..., None]], axis=-1)
    shape = surface.shape[here].transpose(0, 2, 1)
    forces[here] = shape @ (stress * state.area[here][..., None])
    return forces


def contact_tangent(
    surface: ContactSurface, u: Array, penalty: float, state: ContactState, traction: Traction
) -> Array:
    """Derivative of `contact_forces` with the nodal displacements `u`, N/m.

    The parts of a facet are summed: (facets, a, d, a, d). `state` and `traction` are those at `u`.
    Unloaded facets are zero.
    """
    facets, here = surface.firsts.size, _loaded(state, traction)
    surface = surface.of(here)
    state = ContactState(*(part[here] for part in state))
    traction = Traction(*(part[here] for part in traction))
    d_area = surface.footprint_slopes(u)
    stress = np.concatenate([traction.value, state.pressure[..., None]], axis=-1)
    d_pressure = np.where(state.gap < 0.0, -penalty, 0.0)
    d_stress = np.zeros((*stress.shape, stress.shape[-1]))
    d_stress[..., :-1, :-1] = traction.by_displacement
    d_stress[..., :-1, -1] = traction.by_pressure * d_pressure[..., None]
    d_stress[..., -1, -1] = d_pressure
    # the nodal force sum_q s_a t_i A depends on the stress t_i and on the covered area A
    moving = d_stress * state.area[..., None, None]
    turning = stress[:, :, None, :, None] * d_area[:, :, :, None, :]
    parts = surface.summed_pairs(moving, turning)
    tangent, first = np.zeros((facets, *parts.shape[1:])), surface.firsts
    if first.size:
        tangent[surface.whole[first]] = np.add.reduceat(parts, first)
    return tangent


def _loaded(state: ContactState, traction: Traction) -> NDArray[np.intp]:
    """Facets with a load or a load derivative; most of the walls have none."""
    parts = (state.pressure, traction.value, traction.by_displacement)  # zero with them
    return np.flatnonzero(sum(part.any(axis=tuple(range(1, part.ndim))) for part in parts))


def default_penalty(material: MooneyRivlin, height: float, tolerance: float) -> float:
    """Penalty (Pa/m) whose penetration is a fraction of the block's deformation.

    Under a uniform pressure p the block of this height (m) deforms by p H / E, and penetration is p
    / eps. Hence eps = E / (fraction H). The fraction is a tenth of `tolerance`, but between 1e-3
    and 1e-2. Where pressure concentrates at the edges, penetration is 1.5 to 4 times larger
    (scripts.studies.penalty_effect).
    """
    fraction = min(max(PENETRATION_SHARE * tolerance, PENETRATION[0]), PENETRATION[1])
    return material.youngs_modulus / (fraction * height)
