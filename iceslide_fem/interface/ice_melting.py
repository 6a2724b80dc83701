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
from iceslide_fem.interface.conjugate_gradients import conjugate_gradients
from iceslide_fem.interface.ice_surface import StageSurface

# How closely (K) a guess is found, and in how many iterations: it may be left as it is.
CLOSE = 1e-4
MAX_ITERATIONS, LINEAR_ITERATIONS = 12, 30
# How often points share out what a node takes, the share of weights between nodes that melt (1, but
# for rounding), and of the area around a node that melts at least.
FILLINGS, BETWEEN, LEAST_MELTING = 3, 0.999, 0.1


def melting_guess(
    surface: StageSurface, before: Array, power: Array, link: float, melting_temperature: float
) -> Array:
    """Temperature (K) of the nodes, of the grid's shape, from that `before` the stage. Collective.

    power: of the friction at the points and the area of each, (2, n), W and m2; link: K m2/W.
    """
    around, area = surface.grid.scatter(power, surface.at).reshape(2, *before.shape)
    rise, heat, held = _limited(surface, before, around, melting_temperature)
    if not held.any():
        return surface.offset + rise
    below_points = link * _flux(surface, np.where(held, heat, 0.0), held, power, area)
    return np.where(held, melting_temperature - below_points, surface.offset + rise)


def _limited(
    surface: StageSurface, before: Array, power: Array, melting_temperature: float
) -> tuple[Array, Array, Mask]:
    """Rise (K) of the nodes, what they take (W), and which of them are held at T_m.

    A primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865), from the
    nodes that were within CLOSE of it `before`.
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


def _flux(surface: StageSurface, heat: Array, held: Mask, power: Array, area: Array) -> Array:
    """Flux (W/m2) that melting points give around nodes that are `held` and take the `heat` (W).

    Points between such nodes melt, but for those whose friction makes less than the flux: they give
    all of it, as the others do, and what then is missing those that melt give. `area`: of all
    points around the nodes, m2.
    """
    grid, at, (most, own_area) = surface.grid, surface.at, power
    between = grid.interpolate(held.ravel().astype(float), at) > BETWEEN
    flux, least = np.zeros_like(heat), LEAST_MELTING * area
    for _ in range(FILLINGS):
        molten = own_area * grid.interpolate(flux.ravel(), at)
        melts = between & (molten < most)
        amounts = np.stack([np.where(melts, molten, most), own_area * melts])
        given, melting = grid.scatter(amounts, at).reshape(2, *heat.shape)
        room = np.maximum(melting, least)
        flux += np.divide(heat - given, room, out=np.zeros_like(heat), where=held & (room > 0.0))
    return flux


def _beside(surface: StageSurface, held: Mask, rise: Array, power: Array) -> tuple[Array, Array]:
    """Rise (K) of nodes that take the `power` (W) but where they are `held`, and what all take.

    Conjugate gradients. In short stages, in which heat does not get far along the surface, all
    modes conduct nearly the same, and the cells' areas precondition them.
    """
    if not held.any():
        return surface.warmed(power), power
    free = np.where(held, 0.0, 1.0)
    per_heat = free / surface.grid.cell_area.reshape(rise.shape)
    small = CLOSE / surface.resistance.max()
    more, left, _ = conjugate_gradients(
        surface.taken,
        lambda load: per_heat * load,
        power - surface.taken(rise),
        lambda answer, _: not np.abs(answer).max() > small,
        LINEAR_ITERATIONS,
    )
    return rise + more, power - left
