"""Posture of a block on the ice, and the mechanical limit behind a missing equilibrium."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.contact import contact_state
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.rubber import Rubber

FOLDED = 0.02  # an edge counts as folded above this fraction of the load on the sides
TIPPED = 0.8  # an edge counts as lifted below this contact over nominal area
CRUSHED = 0.25  # compression of the height
STEEP = 0.8  # a facet is a side above this sine of its slope
SLENDER = 2.0  # a block or a lug buckles above this height over thickness


class Slenderness(NamedTuple):
    """The most slender part of a block along x: its name, and height and thickness (m)."""

    part: str
    height: float
    thickness: float


def most_slender(mesh: Any, height: float, scene: Rubber) -> Slenderness:
    """The more slender one: the block of this height (m), or a lug between sipes. Collective."""
    x = mesh.geometry.x[:, 0]
    outer = np.array([-x.min(initial=np.inf), x.max(initial=-np.inf)])
    mesh.comm.Allreduce(MPI.IN_PLACE, outer, op=MPI.MAX)
    whole = Slenderness("the block", height, float(outer.sum()))
    cuts, half = scene.cuts, scene.length / 2
    if not cuts:
        return whole
    ends = [-half, *(end for cut in cuts for end in cut.walls), half]
    lugs = [
        Slenderness(
            "a lug between the sipes",
            max(cut.depth for cut in cuts[max(number - 1, 0) : number + 1]),
            ends[2 * number + 1] - ends[2 * number],
        )
        for number in range(len(cuts) + 1)
    ]
    return max(whole, *lugs, key=lambda part: part.height / part.thickness)


class Posture(NamedTuple):
    """Posture of a block, in dimensionless numbers.

    bottom: touching over undeformed area of the bottom (0 without contact); sides: fraction of the
    load on the sides; compression: over the height; sway: largest shift of the bottom along x, over
    the thickness of the most slender part; uneven: largest over mean pressure.
    """

    bottom: float
    sides: float
    compression: float
    sway: float
    uneven: float


def posture(surface: ContactSurface, u: Array, penalty: float, slenderness: Slenderness) -> Posture:
    """The posture of the block at displacements `u` (blocked dofs, d). Collective."""
    contact, comm = contact_state(surface, u, penalty), surface.comm
    bottom = 1.0 - _side(surface)
    touching = (contact.pressure > 0.0).astype(float)
    force = surface.total(contact.pressure, contact.area)
    covered = surface.total(touching, contact.area)
    still = np.zeros_like(u)
    whole = surface.total(np.broadcast_to(bottom * 1.0, touching.shape), surface.footprint(still))
    shift = np.abs(surface.displacements(u)[..., 0] * bottom).max(initial=0.0)
    sunk = max(-float(u[:, -1].min(initial=0.0)), 0.0)
    largest = np.array([contact.pressure.max(initial=0.0), shift, sunk])
    comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
    on_sides = surface.total(contact.pressure * (1.0 - bottom), contact.area)
    return Posture(
        bottom=surface.total(np.where(bottom, touching, 0.0), contact.area) / whole,
        sides=on_sides / force if force else 0.0,
        compression=float(largest[2]) / slenderness.height,
        sway=float(largest[1]) / slenderness.thickness,
        uneven=float(largest[0]) * covered / force if force else 0.0,
    )


def limit_met(found: Posture, slenderness: Slenderness) -> str:
    """The mechanical limit of a block in the posture `found`, in words."""
    if not found.bottom and not found.sides:
        return "the block has lost contact with the ice"
    ways = []
    if found.sides > FOLDED:
        ways.append(f"an edge folds under the block: the sides carry {found.sides:.0%} of the load")
    if found.bottom < TIPPED:
        ways.append(f"it tips: {found.bottom:.0%} of the bottom touches the ice")
    if found.compression > CRUSHED:
        ways.append(f"it is compressed by {found.compression:.0%} of its height")
    ratio = slenderness.height / slenderness.thickness
    if ratio >= SLENDER:
        ways.append(
            f"{slenderness.part} gives way sideways, as a column buckles: it is {ratio:.2g} times "
            f"as tall as thick and has shifted by {found.sway:.0%} of its thickness"
        )
    if not ways:
        ways.append(
            f"{found.bottom:.0%} of the bottom touches the ice, pressed by up to "
            f"{found.uneven:.1f} times the mean pressure"
        )
    return ", and ".join(ways)


def _side(surface: ContactSurface) -> Mask:
    """Mask (f, 1) of side facets: steeper than STEEP in the undeformed body.

    The part of a round edge next to the ice belongs to the bottom.
    """
    corners = surface.nodes[:, : 2 if surface.nodes.shape[-1] == 2 else 3]
    sides = corners[:, 1:] - corners[:, :1]
    if sides.shape[1] == 1:
        rise, length = sides[:, 0, 1], np.linalg.norm(sides[:, 0], axis=1)
        sine = np.abs(rise) / length
    else:
        normal = np.cross(sides[:, 0], sides[:, 1])
        sine = np.hypot(normal[:, 0], normal[:, 1]) / np.linalg.norm(normal, axis=1)
    return np.asarray((sine > STEEP)[:, None])
