"""Step-size control: whether a step may be taken, and how long the next one may be."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Loads, Step, advance, error_norms
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.runtime.arrays import Array, Mask

SAFETY = 0.9
# Of the tolerance, left over in the equation of the film's height.
HEIGHT_SHARE = 1e-3
SHRINK, GROW = 0.1, 2.0
# The same where a point is on its own.
GROW_ALONE = 2.5
# Errors of a dry film move the onset of melting, those of H_s saturation, and mu turns sharply at
# both: they count so many times.
DRY, SQUEEZED = 3.25, 3.0
NO_ERROR = 1e-300  # in place of 0, which has no power below 0


def step_factor(error: Array | float, order: int, grow: float = GROW) -> Array:
    """Factor on the step that brings `error` (1 = just accepted) to its target.

    safety * error^(-1/order), between `SHRINK` and `grow`; an error that is not finite shrinks.
    """
    factor = SAFETY * np.maximum(error, NO_ERROR) ** (-1.0 / order)
    return np.where(factor > SHRINK, np.minimum(factor, grow), SHRINK)


def close_enough(tolerance: float) -> float:
    """Change of ln h after which a height is found (`film.height`).

    What is left, of the order of its cube, is then a thousandth of the `tolerance`.
    """
    return max(CLOSE, float(np.cbrt(HEIGHT_SHARE * tolerance)))


class ScaledLoads(Loads, Protocol):
    """Loads that say what errors of water and of temperatures are relative to."""

    def water_scale(self, step: Step) -> Array:
        """Height (m), (n,), that errors of the water in the voids count by, of a `step`."""

    def temperature_scale(self, step: Step, scale: Array) -> Array:
        """The `scale` (K), (n,), of errors of temperatures, or less where tau follows them."""


class StepControl(NamedTuple):
    """How steps of many points are made and judged, each on its own.

    tolerance: relative error of mu(t) aimed at, or None for steps that are taken as they are;
    close: how closely heights are found, see `close_enough`; dry: how many times errors of ln h
    count where nothing melts.
    """

    integrator: Integrator
    tolerance: float | None
    close: float = CLOSE
    dry: float = DRY

    def trial(
        self,
        state: InterfaceState,
        loads: ScaledLoads,
        end: ScaledLoads,
        dt: Array,
        ice: IceHeat,
        temperature_scale: Array,
        rubber: RubberHeat = INSULATED,
        rate: Array | None = None,
    ) -> Trial:
        """A step of `dt` (s, one per point) from `loads` to `end`.

        `rate` is d ln h / dt (1/s) at its start as far as that is known. Its errors are those of
        `error_norms`, with the weights above.
        """
        method = self.integrator
        step = advance(state, loads, end, dt, ice, method, rubber, rate, self.close)
        if self.tolerance is None:
            return Trial(step, np.isfinite(step.state.log_height), dt)
        free = end.water_scale(step) / SQUEEZED
        scale = end.temperature_scale(step, temperature_scale)
        error = error_norms(step, ice, free, scale, rubber, self.dry)
        error /= method.allowed * self.tolerance
        factor = step_factor(error, method.estimate_order, GROW_ALONE)
        return Trial(step, error <= 1.0, dt * factor)


class Trial(NamedTuple):
    """A step, at which points it is good enough, and the length (s) of the next one there."""

    step: Step
    good: Mask
    following: Array
