"""Which nodes of the ice melt in a stage: a guess from what friction makes before it.

No node gets warmer than T_m, and none takes more heat g than friction makes around it:

    T = T_offset + R g,   T <= T_m,   g <= P,   one of them equal at every node.

Dozens of points lie around each node: from there, what they give is found in fewer changes of the
melting set. Where nodes melt, the interface resistance of the points says how far from T_m they
are: by as much as it takes to pass their flux on.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.interface.conjugate_gradients import conjugate_gradients
from iceslide_fem.interface.ice_conduction import SurfaceConduction
from iceslide_fem.interface.shared_points import SharedPoints
from iceslide_fem.runtime.arrays import Array, Mask

# How closely (K) a guess is found, and in how many iterations: it may be left as it is.
CLOSE, GUESS_ITERATIONS = 1e-4, 12
GUESS_TOLERANCE, GUESS_LINEAR_ITERATIONS = 1e-4, 30
# How often points share out what a node takes, the fraction of weights between nodes that melt (1,
# but for rounding), and of the area around a node that melts at least.
FILLINGS, BETWEEN, LEAST_MELTING = 3, 0.999, 0.1


def melting_guess(
    ice: SurfaceConduction,
    points: SharedPoints,
    power: Array,
    before: Array,
    interface_resistance: float,
    T_m: float,
) -> Array:
    """Temperature (K) of the nodes, shaped as that `before` the stage.

    power: of the friction at all points, W, and the area of each, m2, (N, 2); interface_resistance:
    K m2/W.
    """
    made, area = (points.gives @ power).T
    most, rise = T_m - ice.offset, before.ravel() - ice.offset
    held, rise, heat = _limited(ice, made, most, rise)
    temperature = ice.offset + rise
    if held.any():
        flux = _flux_of_melting(points, power, area, heat, held)
        temperature = np.where(held, T_m - interface_resistance * flux, temperature)
    return temperature.reshape(before.shape)


def _limited(
    ice: SurfaceConduction, power: Array, most: Array, rise: Array
) -> tuple[Mask, Array, Array]:
    """Which nodes are held at `most` (K), the rise (K) of all and the heat (W) that they take.

    A primal-dual active set (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865),
    from the nodes that were within CLOSE of it.
    """
    held = (power > 0.0) & (rise >= most - CLOSE)
    for _ in range(GUESS_ITERATIONS):
        rise, heat = _beside(ice, held, power, np.where(held, most, rise))
        warmer = (power > 0.0) & (rise > most + CLOSE)
        changes = np.where(held, heat > power, warmer)
        held = held ^ changes
        if not changes.any():
            break
    return held, rise, heat


def _beside(ice: SurfaceConduction, held: Mask, power: Array, rise: Array) -> tuple[Array, Array]:
    """Rise (K) of nodes that take the `power` (W) but where they are `held` at what `rise` is now,
    and the heat (W) that all take, by conjugate gradients.

    In short stages, in which heat does not get far along the surface, all modes conduct nearly the
    same, and the cells' areas precondition them.
    """
    if not held.any():
        return ice.warmed(power), power
    if held.all():
        return rise, ice.taken(rise)
    free = np.flatnonzero(~held)
    change = np.zeros_like(rise)

    def taken(x: Array) -> Array:
        change[free] = x
        return ice.taken(change)[free]

    def answered(load: Array) -> Array:
        return load / ice.cell_area[free]

    left = (power - ice.taken(rise))[free]
    found, _ = conjugate_gradients(taken, answered, left, GUESS_TOLERANCE, GUESS_LINEAR_ITERATIONS)
    rise[free] += found
    return rise, np.where(held, ice.taken(rise), power)


def _flux_of_melting(
    points: SharedPoints, power: Array, area: Array, heat: Array, held: Mask
) -> Array:
    """Flux (W/m2) that melting points give around nodes that are `held` and take the `heat` (W).

    Points between such nodes melt, but for those whose friction makes less than the flux: they give
    all of it, as the others do, and what then is missing those that melt give. area: of all points
    around the nodes, m2.
    """
    makes, areas = power.T
    between = points.reads @ held.astype(float) > BETWEEN
    flux = np.zeros_like(heat)
    for _ in range(FILLINGS):
        molten = areas * (points.reads @ flux)
        melts = between & (molten < makes)
        around = points.gives @ np.where(melts, molten, makes)
        melting = np.maximum(points.gives @ np.where(melts, areas, 0.0), LEAST_MELTING * area)
        some = held & (melting > 0.0)
        flux[some] += ((heat - around)[some]) / melting[some]
    return flux
