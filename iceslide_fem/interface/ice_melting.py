"""Which nodes of the meshed ice melt in a stage: a first guess from what friction makes before it.

No node gets warmer than T_m, and none takes more heat g than friction makes around it. With the
surface's response R to heat,

    T = T_offset + R g,   T <= T_m,   g <= P,   one of them equal at every node.

Dozens of points lie around each node: from there, what they give is found in fewer changes of the
melting set (`ice_surface`). Where nodes melt, the points' link says how far from T_m they are: by
as much as it takes to pass their flux on.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.interface.ice_surface import StageSurface

# How closely (K) a guess is found, and in how many iterations: it may be left as it is.
CLOSE = 1e-4
MAX_ITERATIONS, LINEAR_ITERATIONS = 12, 30


def melting_guess(
    surface: StageSurface, before: Array, power: Array, link: float, melting_temperature: float
) -> Array:
    """Temperature (K) of the nodes, of the grid's shape, from that `before` the stage. Collective.

    power: of the friction at the points and the area of each, (2, n), W and m2; link: K m2/W.
    """
    around, area = surface.grid.scatter(power, surface.at).reshape(2, *before.shape)
    rise, heat, held = _limited(surface, before, around, melting_temperature)
    flux = np.divide(heat, area, out=np.zeros_like(heat), where=held)
    return np.where(held, melting_temperature - link * flux, surface.offset + rise)


def _limited(
    surface: StageSurface, before: Array, power: Array, melting_temperature: float
) -> tuple[Array, Array, Mask]:
    """Rise (K) of the nodes, what they take (W), and which of them are held at T_m.

    A primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865), from the
    nodes that melted `before`.
    """
    most, touched = melting_temperature - surface.offset, power > 0.0
    held: Mask = touched & (before >= melting_temperature - CLOSE)
    rise = before - surface.offset
    for _ in range(MAX_ITERATIONS):
        rise, heat = _beside(surface, held, np.where(held, most, rise), power)
        change = np.where(held, heat > power, touched & (rise > most + CLOSE))
        if not change.any():
            break
        held = held ^ change
    return rise, heat, held


def _beside(surface: StageSurface, held: Mask, rise: Array, power: Array) -> tuple[Array, Array]:
    """Rise (K) of nodes that take the `power` (W) but where they are `held`, and what all take.

    Conjugate gradients. In short stages, in which heat does not get far along the surface, all
    modes conduct nearly the same, and the cells' areas precondition them.
    """
    free = np.where(held, 0.0, 1.0)
    per_heat = free / surface.grid.cell_area.reshape(rise.shape)
    small = CLOSE / surface.resistance.max()
    heat = surface.taken(rise)
    left = free * (power - heat)
    direction = answer = per_heat * left
    size = float(np.vdot(left, answer))
    for _ in range(LINEAR_ITERATIONS):
        if not np.abs(answer).max() > small:
            break
        against = surface.taken(direction)
        length = size / float(np.vdot(direction, against))
        rise = rise + length * direction
        heat = heat + length * against
        left = free * (power - heat)
        answer = per_heat * left
        size, before = float(np.vdot(left, answer)), size
        direction = answer + size / before * direction
    return rise, heat
