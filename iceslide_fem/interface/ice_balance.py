"""The heat balance between ice and contact points in an implicit stage.

The heat from the points falls with the temperature below them, steeply where they melt. The
equations are the gradient of a convex function. Newton's method with a line search finds its
minimum; conjugate gradients solve each Newton step.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded
from scipy.sparse.linalg import LinearOperator, cg

from iceslide_fem.interface.ice_modes import SurfaceConduction
from iceslide_fem.interface.shared_points import SharedPoints
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import NotConverged

_TOLERANCE = "rtol" if "rtol" in inspect.signature(cg).parameters else "tol"  # since SciPy 1.12

Function = Callable[[Array], Array]


def conjugate_gradients(
    system: Function, inverse: Function, load: Array, tolerance: float, iterations: int
) -> tuple[Array, bool]:
    """Solve system(x) = load to a relative residual; x (n,), and whether it converges.

    inverse: the preconditioner.
    """
    n = load.size
    operator, near = (LinearOperator((n, n), one, dtype=float) for one in (system, inverse))
    found, fault = cg(
        operator, load, maxiter=iterations, M=near, atol=0.0, **{_TOLERANCE: tolerance}
    )
    return np.asarray(found), not fault


# Tolerance of the balance, relative to the agreement of ice and film.
BALANCED, MAX_ITERATIONS = 0.1, 60
LINEAR_TOLERANCE, LINEAR_ITERATIONS = 1e-3, 500
# Line search: largest final slope over the first one; number of trials.
ENOUGH, SEARCH_TRIALS = 0.1, 12
NOT_FOUND = "the melting part of the ice's surface is not found"


class Balance(NamedTuple):
    """Temperatures (K) of the nodes and heat from the points (W), both shaped as the stage.

    depends: whether the heat depends on the temperature; changes: number of Newton steps.
    """

    temperature: Array
    given: Array
    depends: bool
    changes: int

    @property
    def converged(self) -> bool:
        """Whether the heat from the points is the first one."""
        return self.changes == 0


class Lines(NamedTuple):
    """Heat from points (W) near reference temperatures: the smaller of two linear functions.

    Each is a heat at the reference minus its fall (W/K) times the rise (K); arrays (n,).
    """

    heat: Array
    fall: Array
    other_heat: Array
    other_fall: Array

    def at(self, rise: Array) -> tuple[Array, Array]:
        """Heat (W) at a `rise` (K) above the reference, and its fall there (W/K)."""
        one, other = self.heat - self.fall * rise, self.other_heat - self.other_fall * rise
        return np.minimum(one, other), np.where(other < one, self.other_fall, self.fall)

    def heat_at(self, rise: Array) -> Array:
        """Heat (W) at a `rise` (K) above the reference."""
        return np.minimum(self.heat - self.fall * rise, self.other_heat - self.other_fall * rise)


def balance(
    ice: SurfaceConduction, points: SharedPoints, lines: Lines, reference: Array, agreement: float
) -> Balance:
    """The balance with the `lines` of all points around `reference` temperatures (K).

    The reference itself is the balance if all nodes agree within `agreement` (K). Otherwise the
    balance is found to a fraction of it. Raises NotConverged.
    """
    temperature, depends, target = reference.ravel().copy(), False, agreement
    takes = ice.taken(temperature - ice.offset)
    rise, heat, fall = np.zeros(lines.heat.size), lines.heat, lines.fall
    for changes in range(MAX_ITERATIONS):
        given = points.gives @ heat
        imbalance = takes - given
        residual = ice.warmed(imbalance)
        off = float(np.abs(residual).max(initial=0.0))
        if off <= target:
            shape = reference.shape
            return Balance(temperature.reshape(shape), given.reshape(shape), depends, changes)
        if not np.isfinite(off):
            break
        target = BALANCED * agreement
        if fall.any():
            depends = True
            change = -_correction(ice, points.coupling(fall), imbalance)
        else:
            change = -residual
        moved, more = points.reads @ change, ice.taken(change)
        slopes = float(change @ imbalance), float(change @ takes), float(change @ more)
        step_length = _search(lines, rise, moved, *slopes)
        temperature += step_length * change
        takes = takes + step_length * more
        rise = rise + step_length * moved
        heat, fall = lines.at(rise)
    raise NotConverged(NOT_FOUND)


def _correction(ice: SurfaceConduction, bands: Array, load: Array) -> Array:
    """Temperatures (K) at which conduction and the points' slopes take a `load` (W).

    The preconditioner is the slopes' band matrix with the conduction of a middle mode: in short
    stages all modes conduct nearly the same. Raises NotConverged.
    """
    n, factor = load.size, bands.copy()
    factor[0] += ice.cell_area / ice.middle
    try:
        factored = cholesky_banded(factor, lower=True, check_finite=False)
    except LinAlgError:
        raise NotConverged("the linear solver of the ice's temperature fails") from None
    couples = [(d, bands[d, : n - d]) for d in np.flatnonzero(bands.any(axis=1))]

    def loaded(x: Array) -> Array:
        out = ice.taken(x)
        for apart, band in couples:
            out[apart:] += band * x[: n - apart]
            if apart:
                out[: n - apart] += band * x[apart:]
        return out

    def answered(x: Array) -> Array:
        return cho_solve_banded((factored, True), x, check_finite=False)

    found, enough = conjugate_gradients(loaded, answered, load, LINEAR_TOLERANCE, LINEAR_ITERATIONS)
    if not enough or not np.isfinite(found).all():
        raise NotConverged("the linear solver of the ice's temperature fails")
    return found


def _search(
    lines: Lines, rise: Array, moved: Array, first: float, alone: float, curvature: float
) -> float:
    """Line search: the fraction of a Newton step at which the slope is about zero.

    The full step is taken unless it goes well past the minimum. Then points that melt stop melting,
    and the next step would undo this one. The zero is found by false position (Illinois). first:
    slope at the start, < 0; alone, curvature: slope there without the points, and its growth;
    moved: change (K) of the points, whose rise is `rise`.
    """
    step_length, low, below, high, above = 1.0, 0.0, first, 1.0, 0.0
    for trial in range(SEARCH_TRIALS):
        slope = (
            alone
            + step_length * curvature
            - float(moved @ lines.heat_at(rise + step_length * moved))
        )
        if (slope if trial == 0 else abs(slope)) <= -ENOUGH * first:
            break
        if trial == 0:
            above = slope
        elif slope > 0.0:
            high, above, below = step_length, slope, 0.5 * below
        else:
            low, below, above = step_length, slope, 0.5 * above
        step_length = low - below * (high - low) / (above - below)
    return step_length


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
