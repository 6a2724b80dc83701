"""Step-size control: whether a step may be taken, and how long the next one may be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import Integrator, InterfaceState, Step, advance, error_norms
from iceslide_fem.film.law import FilmLoads
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat

SAFETY = 0.9
SHRINK, GROW = 0.1, 2.0


def step_factor(error: Array | float, order: int) -> Array:
    """Factor on the step that brings `error` (1 = just accepted) to its target.

    safety * error^(-1/order), between `SHRINK` and `GROW`; an error that is not finite shrinks.
    """
    error = np.nan_to_num(np.asarray(error, dtype=float), nan=np.inf, posinf=np.inf)
    with np.errstate(divide="ignore"):
        return np.clip(SAFETY * error ** (-1.0 / order), SHRINK, GROW)


class StepControl(NamedTuple):
    """How steps of many points are made and judged, each on its own.

    tolerance: relative error of mu(t) aimed at, or None for steps that are taken as they are.
    """

    integrator: Integrator
    tolerance: float | None

    def trial(
        self,
        state: InterfaceState,
        loads: FilmLoads,
        end: FilmLoads,
        dt: Array,
        ice: IceHeat,
        temperature_scale: Array,
        rubber: RubberHeat = INSULATED,
    ) -> Trial:
        """A step of `dt` (s, one per point) from `loads` to `end`; errors as in `error_norms`."""
        method = self.integrator
        step = advance(state, loads, end, dt, ice, method, rubber)
        if self.tolerance is None:
            return Trial(step, np.isfinite(step.state.log_height), dt)
        error = error_norms(step, ice, state, end.free_height, temperature_scale, rubber)
        error = error / (method.share * self.tolerance)
        return Trial(step, error <= 1.0, dt * step_factor(error, method.estimate_order))


class Trial(NamedTuple):
    """A step, at which points it is good enough, and the length (s) of the next one there."""

    step: Step
    good: Mask
    following: Array
