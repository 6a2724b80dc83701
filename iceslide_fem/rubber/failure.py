"""Which physical limit a block has met when no equilibrium is found: said in one sentence."""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.rubber.contact import contact_state
from iceslide_fem.rubber.contact_surface import ContactSurface

FOLDED = 0.02  # share of the load on the sides from which on an edge counts as folded
TIPPED = 0.8  # contact over nominal area below which an edge counts as lifted
CRUSHED = 0.25  # compression of the height


def limit_met(surface: ContactSurface, u: Array, penalty: float, area: float, height: float) -> str:
    """The state of the block at displacements `u` (blocked dofs, d): what it gives way by.

    `area`: the nominal contact area (m2; m in a slice); `height`: of the block, m. Collective.
    """
    contact = contact_state(surface, u, penalty)
    nodes = surface.nodes
    comm = surface.comm
    floor = comm.allreduce(float(nodes[..., -1].min(initial=np.inf)), op=MPI.MIN)
    side = (nodes[..., -1].max(axis=1, initial=-np.inf) > floor + 1e-6 * height)[:, None]
    touching = (contact.pressure > 0.0).astype(float)
    force = surface.total(contact.pressure, contact.area)
    folded = surface.total(contact.pressure * side, contact.area) / force if force else 0.0
    share = surface.total(touching * ~side, contact.area) / area
    sunk = comm.allreduce(float(u[:, -1].min(initial=0.0)), op=MPI.MIN)
    if not force:
        return "the block has lost contact with the ice"
    found = []
    if folded > FOLDED:
        found.append(f"an edge folds under the block: the sides carry {folded:.0%} of the load")
    if share < TIPPED:
        found.append(f"it tips: the bottom touches the ice on {share:.0%} of the nominal area")
    if -sunk > CRUSHED * height:
        found.append(f"it is compressed by {-sunk / height:.0%} of its height")
    if not found:
        largest = comm.allreduce(float(contact.pressure.max(initial=0.0)), op=MPI.MAX)
        mean = force / surface.total(touching, contact.area)
        found = [
            f"it touches the ice on {share:.0%} of the nominal area, "
            f"pressed by up to {largest / mean:.1f} times the mean pressure"
        ]
    return ", and ".join(found)
