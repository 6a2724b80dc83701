"""A temperature-dependent viscosity, and its value in an implicit stage.

The film's temperature is that of the ice's surface, at most T_m (with heat in the rubber T_f of
`film_between`): before melting a film is supercooled. Viscous friction warms the film, and the
viscosity falls with temperature. eta = eta(T(eta)) therefore has one root: the right side falls
with eta.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from iceslide_fem.runtime.arrays import Array, Index, some_of
from iceslide_fem.runtime.columns import VISCOSITY
from iceslide_fem.runtime.curve import Curve

Stage = TypeVar("Stage")
Scale = TypeVar("Scale", float, Array)

FILM_VISCOSITY = VISCOSITY.column
SETTLED = 1e-10  # tolerance of ln eta
MOST_PASSES = 100
WARMER = 1e-3  # K, step of the numerical derivative


class VariableViscosity(NamedTuple):
    """ln(eta(T) / eta_0) of a `table`; eta_0 is the `reference`, Pa s, for all points or each."""

    table: Curve
    reference: Array | float

    def __call__(self, temperature: Array) -> Array:
        """ln(eta / eta_0) at temperatures (n,), K."""
        return np.asarray(np.log(self.table(temperature) / self.reference))

    def fall(self, temperature: Array) -> Array:
        """- d ln eta / dT (1/K), one-sided towards higher temperature, (n,)."""
        return (self(temperature) - self(temperature + WARMER)) / WARMER

    def take(self, index: Index) -> VariableViscosity:
        """The same at the points of `index`."""
        return VariableViscosity(self.table, some_of(self.reference, index))


def temperature_scale(undercooling: Scale, table: Curve | None) -> Scale:
    """Reference of temperature errors (K): T_m - T_0, or less where it changes eta by 100 %.

    The viscosity has no error estimate, because it jumps where contact begins.
    """
    if table is None:
        return undercooling
    steps = np.diff(table.x), np.diff(np.log(table.values))
    steepest = float(np.max(-steps[1] / steps[0]))
    return np.minimum(undercooling, 1.0 / steepest) if steepest > 0.0 else undercooling


def consistent_viscosity(
    stage: Callable[[Array], tuple[Array, Stage]],
    variable_viscosity: VariableViscosity,
    start: Array,
) -> tuple[Array, Array, Stage]:
    """ln(eta / eta_0), (n,), consistent with the temperature (K) of its stage; both, too.

    stage: function from ln(eta / eta_0) to temperature and stage; start: first guess. Secant
    method, safeguarded by a bracket. Points that do not converge are NaN.
    """
    values = variable_viscosity.table.values
    ends = np.log([max(values), min(values)])
    highest, lowest = (end - np.log(variable_viscosity.reference) for end in ends)
    high, low = np.broadcast_to(highest, start.shape), np.broadcast_to(lowest, start.shape)
    here, before, residual_before = start, start, np.full_like(start, np.nan)
    for _ in range(MOST_PASSES):
        temperature, found = stage(here)
        aim = variable_viscosity(temperature)
        residual = here - aim
        if not (np.abs(residual) > SETTLED).any():
            return here, temperature, found
        low, high = np.where(residual < 0.0, here, low), np.where(residual > 0.0, here, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (residual - residual_before) / (here - before)
            next_one = np.where(slope >= 1.0, here - residual / slope, aim)
        outside = (next_one < low) | (next_one > high)
        before, residual_before = here, residual
        here = np.where(outside, 0.5 * (low + high), next_one)
    return np.where(np.abs(residual) > SETTLED, np.nan, before), temperature, found
