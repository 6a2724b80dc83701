"""Opening of the sipes: their walls feel the ice but not each other, so overlap must be seen."""

from __future__ import annotations

import numpy as np

from iceslide_fem.mesh.box import sipe_ranges
from iceslide_fem.rubber.block import Block


def smallest_opening(block: Block) -> float:
    """Smallest distance along x between opposite walls of the sipes, m; below 0 where they overlap.

    Infinite without sipes. Opposite nodes are those of the same y and z. Collective.
    """
    rubber, scene = block.rubber, block.scene
    if not sipe_ranges(scene):
        return np.inf
    owned = rubber.space.dofmap.index_map.size_local
    positions = rubber.space.tabulate_dof_coordinates()[:owned]
    in_slot = positions[:, rubber.mesh.geometry.dim - 1] <= scene.rubber.sipe_depth + 1e-9
    openings = [np.inf]
    for low, high in sipe_ranges(scene):
        walls = []
        for wall in (low, high):
            mine = np.isclose(positions[:, 0], wall, atol=1e-9) & in_slot
            deformed = wall + rubber.displacements[:owned][mine, 0]
            parts = rubber.mesh.comm.allgather(np.column_stack([positions[mine, 1:], deformed]))
            nodes = np.concatenate(parts)
            order = np.lexsort(np.round(nodes[:, :-1].T, 9))
            walls.append(nodes[order, -1])
        openings.append(float((walls[1] - walls[0]).min()))
    return min(openings)
