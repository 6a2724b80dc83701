"""The balance of what ice takes in a stage and what points give to it.

What points give falls with the temperature below them, steeply where they melt: the equations are
the gradient of a convex function. Newton's method finds its least with a line search, each change
by conjugate gradients.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from iceslide_fem.interface.conjugate_gradients import conjugate_gradients
from iceslide_fem.interface.ice_conduction import SurfaceConduction
from iceslide_fem.interface.shared_points import SharedPoints
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged

# Of the agreement of ice and film: how closely what the film gives is balanced in between.
BALANCED, MAX_ITERATIONS = 0.1, 60
LINEAR_TOLERANCE, LINEAR_ITERATIONS = 1e-3, 500
# A line search: the fraction of the first slope that may be left of it, uphill; trials.
ENOUGH, SEARCH_TRIALS = 0.1, 12
NOT_FOUND = "the melting part of the ice's surface is not found"


class Balance(NamedTuple):
    """Temperatures (K) of the nodes and what the points give to them (W), shaped as the stage.

    depends: whether any of that has become another because of the temperature; changes: of those.
    """

    temperature: Array
    given: Array
    depends: bool
    changes: int

    @property
    def converged(self) -> bool:
        """Whether the points give what they gave at first."""
        return self.changes == 0


class Lines(NamedTuple):
    """What points give (W) near reference temperatures: the smaller of two
    lines, a heat there less its fall (W/K) times how much warmer (K) it is; each (n,).
    """

    heat: Array
    fall: Array
    other_heat: Array
    other_fall: Array

    def at(self, rise: Array) -> tuple[Array, Array]:
        """Heat (W) where the points are by `rise` (K) warmer, and how it falls there (W/K)."""
        one, other = self.heat - self.fall * rise, self.other_heat - self.other_fall * rise
        return np.minimum(one, other), np.where(other < one, self.other_fall, self.fall)

    def heat_at(self, rise: Array) -> Array:
        """Heat (W) where the points are by `rise` (K) warmer."""
        return np.minimum(self.heat - self.fall * rise, self.other_heat - self.other_fall * rise)


def balance(
    ice: SurfaceConduction, points: SharedPoints, lines: Lines, reference: Array, agreement: float
) -> Balance:
    """The balance with these `lines` of all points, `reference` at temperatures (K) of the nodes:
    those, where all agree by so much (K), else one within a fraction of it. Raises NotConverged.
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
    """The temperatures (K) at which conduction and the points' slopes take a `load` (W).

    Preconditioned by the slopes' `bands` with the conduction of a mode in the middle: in short
    stages all modes have nearly the same. Raises NotConverged.
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
    """The fraction of a change with which the minimum along it is near enough: where a full one has
    gone well past it (points that melted do so no longer, and the next would undo it), the fraction
    at which the slope is about zero, by false position (Illinois).

    `first`: the slope at its start, < 0; without the points it is `alone` there and grows by
    `curvature`. moved: change (K) of the points whose rise is `rise`.
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
