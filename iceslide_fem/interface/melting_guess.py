"""Guess of the melting nodes of the ice in a stage, from the friction power before it.

No node is warmer than T_m, and none takes more heat g than the friction power P around it:

    T = T_offset + R g,   T <= T_m,   g <= P,   one of them equal at every node.

Dozens of points lie around each node. This guess reduces the number of changes of the melting set.
A melting node is below T_m by the flux of its points times the interface resistance.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.interface.conjugate_gradients import conjugate_gradients
from iceslide_fem.interface.ice_conduction import SurfaceConduction
from iceslide_fem.interface.shared_points import SharedPoints
from iceslide_fem.runtime.arrays import Array, Mask

# Tolerance (K) of the guess, and largest number of iterations. It need not converge.
CLOSE, GUESS_ITERATIONS = 1e-4, 12
GUESS_TOLERANCE, GUESS_LINEAR_ITERATIONS = 1e-4, 30
# Number of iterations that distribute the heat of a node over its points; least weight between
# melting nodes (1 but for rounding); least melting fraction of the area around a node.
FILLINGS, BETWEEN, LEAST_MELTING = 3, 0.999, 0.1


def melting_guess(
    ice: SurfaceConduction,
    points: SharedPoints,
    power: Array,
    before: Array,
    interface_resistance: float,
    T_m: float,
) -> Array:
    """Guess of the nodal temperatures (K), shaped as `before` the stage.

    power: friction power (W) and area (m2) of all points, (N, 2); interface_resistance: K m2/W.
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
    """Mask of the nodes held at `most` (K), and rise (K) and heat (W) of all nodes.

    Primal-dual active set method (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002)
    865). It starts from the nodes within CLOSE of `most`.
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
    """Rise (K) and heat (W) of all nodes, by conjugate gradients.

    Nodes that are `held` keep their `rise`; the others take the `power` (W). In short stages all
    modes conduct nearly the same, so the cell areas are the preconditioner.
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
    """Flux (W/m2) of melting points around nodes that are `held` and take the `heat` (W).

    Points between held nodes melt, unless their friction power is below this flux. All other points
    give their whole friction power. The melting points give the rest of the heat. area: of all
    points around the nodes, m2.
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
