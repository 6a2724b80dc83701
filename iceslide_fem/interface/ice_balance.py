"""The heat balance between ice and contact points in an implicit stage.

`heat.newton` finds it; conjugate gradients solve each Newton step.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded
from scipy.sparse.linalg import LinearOperator, cg

from iceslide_fem.heat.newton import NOT_FOUND, balanced
from iceslide_fem.interface.ice_modes import SurfaceConduction
from iceslide_fem.interface.surface_grid import SharedPoints
from iceslide_fem.runtime.arrays import Array
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
ENOUGH = 0.1  # largest slope at the end of a line search over the first one


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


@dataclass(frozen=True)
class PointsOnIce:
    """Temperatures (K) of nodes, and the rise (K) of points, whose heat the `lines` give.

    takes: heat that the ice takes, W; heat, fall: of the points, W and W/K; target: largest
    temperature (K) of an imbalance, after the first guess a fraction of the `agreement`; depends:
    whether heat that depends on the temperature led here.
    """

    ice: SurfaceConduction
    points: SharedPoints
    lines: Lines
    agreement: float
    temperature: Array
    takes: Array
    rise: Array
    heat: Array
    fall: Array
    target: float
    depends: bool = False

    @cached_property
    def given(self) -> Array:
        """Heat from the points to the nodes, W."""
        return self.points.gives @ self.heat

    @cached_property
    def imbalance(self) -> Array:
        """What the ice takes more than it is given, W."""
        return self.takes - self.given

    @cached_property
    def residual(self) -> Array:
        """Temperatures (K) that the imbalance makes."""
        return self.ice.warmed(self.imbalance)

    @property
    def settled(self) -> bool:
        """Whether the imbalance warms no node by more than the target."""
        off = float(np.abs(self.residual).max(initial=0.0))
        if not np.isfinite(off):
            raise NotConverged(NOT_FOUND)
        return off <= self.target

    def change(self) -> Array:
        """The Newton step (K) of the nodes."""
        if not self.fall.any():
            return -self.residual
        return -_correction(self.ice, self.points.coupling(self.fall), self.imbalance)

    def along(self, change: Array) -> tuple[float, Callable[[float], tuple[float, PointsOnIce]]]:
        """Slope along a `change` (K), and slope and temperatures after a fraction of it."""
        moved, more = self.points.reads @ change, self.ice.taken(change)
        alone, growth = float(change @ self.takes), float(change @ more)
        depends, target = self.depends or bool(self.fall.any()), BALANCED * self.agreement

        def at(length: float) -> tuple[float, PointsOnIce]:
            rise = self.rise + length * moved
            heat, fall = self.lines.at(rise)
            there = replace(
                self,
                temperature=self.temperature + length * change,
                takes=self.takes + length * more,
                rise=rise,
                heat=heat,
                fall=fall,
                target=target,
                depends=depends,
            )
            return alone + length * growth - float(moved @ heat), there

        return float(change @ self.imbalance), at


def balance(
    ice: SurfaceConduction, points: SharedPoints, lines: Lines, reference: Array, agreement: float
) -> Balance:
    """The balance with the `lines` of all points around `reference` temperatures (K).

    The reference itself is the balance if all nodes agree within `agreement` (K). Otherwise the
    balance is found to a fraction of it. Raises NotConverged.
    """
    temperature = reference.ravel()
    takes, rise = ice.taken(temperature - ice.offset), np.zeros(lines.heat.size)
    first = PointsOnIce(
        ice, points, lines, agreement, temperature, takes, rise, lines.heat, lines.fall, agreement
    )
    found, changes = balanced(first, MAX_ITERATIONS, ENOUGH)
    shape = reference.shape
    return Balance(
        found.temperature.reshape(shape), found.given.reshape(shape), found.depends, changes
    )


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
