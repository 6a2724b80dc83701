"""How a block stands on the ice, and which limit it has met when no equilibrium is found."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.rubber.contact import contact_state
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.rubber import Rubber

FOLDED = 0.02  # fraction of the load on the sides from which on an edge counts as folded
TIPPED = 0.8  # contact over nominal area below which an edge counts as lifted
CRUSHED = 0.25  # compression of the height
STEEP = 0.8  # sine of the slope from which on a facet is a side
SLENDER = 2.0  # height over thickness from which on a block or a lug of it buckles


class Slenderness(NamedTuple):
    """The most slender part of a block along x: its name, and height and thickness (m)."""

    part: str
    height: float
    thickness: float


def most_slender(mesh: Any, height: float, scene: Rubber) -> Slenderness:
    """The block of that height (m) or a lug between its sipes. Collective."""
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
    """How a block stands: fraction of what is named.

    bottom: area of the bottom that touches, of the undeformed one; sides: the load that the sides
    carry; compression: of the height; sway: largest shift of the bottom along x below the plate,
    of the thickness of its most slender part; uneven: largest over mean pressure. Without contact
    bottom is 0.
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
    """What a block in the posture `found` gives way by, in words."""
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
    """Which facets (f, 1) are not of the bottom: steeper than STEEP in the undeformed body, so that
    of a round edge the part next to the ice is bottom.
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
