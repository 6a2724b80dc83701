"""Step-size control: acceptance of a step, and length of the next one."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np

from iceslide_fem.film.driving import PointLoads
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import PointIce
from iceslide_fem.film.integrators import InterfaceState, Step, Weights, advance
from iceslide_fem.film.law import FilmStage
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat
from iceslide_fem.film.runge_kutta import INTEGRATORS, Integrator
from iceslide_fem.runtime.arrays import Array, Index, Mask

SAFETY = 0.9
# Residual of the film height equation, over the tolerance.
HEIGHT_SHARE = 1e-3
SHRINK, GROW = 0.1, 2.0
# The same for a single point.
GROW_ALONE = 2.5
# Weights of errors of a dry film and of H_s: they shift melt onset and saturation, where mu has a
# kink.
DRY, SQUEEZED = 3.25, 3.0
ONE_STAGE = INTEGRATORS["implicit-euler"]
NO_ERROR = 1e-300  # replaces 0, which has no negative power


def step_factor(error: Array | float, order: int, grow: float = GROW) -> Array:
    """Factor on the step that brings `error` (1 = just accepted) to its target.

    safety * error^(-1/order), between `SHRINK` and `grow`; an error that is not finite shrinks.
    """
    factor = SAFETY * np.maximum(error, NO_ERROR) ** (-1.0 / order)
    return np.where(factor > SHRINK, np.minimum(factor, grow), SHRINK)


def close_enough(tolerance: float) -> float:
    """Last change of ln h in the search of a height (`film.height`).

    The remaining error, of the order of its cube, is a thousandth of the `tolerance`.
    """
    return max(CLOSE, float(np.cbrt(HEIGHT_SHARE * tolerance)))


class StepControl(NamedTuple):
    """Makes and judges steps of many points, each separately.

    tolerance: target relative error of mu(t), or None for fixed steps; close: accuracy of heights,
    see `close_enough`; dry: weight of errors of ln h where nothing melts.
    """

    integrator: Integrator
    tolerance: float | None
    close: float = CLOSE
    dry: float = DRY

    def trial(
        self,
        state: InterfaceState,
        loads: PointLoads,
        end: PointLoads,
        dt: Array,
        ice: PointIce,
        temperature_scale: Array,
        rubber: RubberHeat = INSULATED,
        rate: Array | None = None,
    ) -> Trial:
        """A step of `dt` (s, one per point) from `loads` to `end`.

        Where water meets cold ice the flux into the ice is infinite at first, and a little water
        freezes at once. Several stages would freeze it more than once, so such steps have one.
        rate: d ln h / dt (1/s) at its start, if known. Errors are those of `error_norms`, with the
        weights above.
        """
        method = self.integrator
        step = advance(state, loads, end, dt, ice, method, rubber, rate, self.close)
        over = np.flatnonzero(end.overfreezes(step, ice))
        if over.size:
            begins = state.take(over), loads.take(over), end.take(over), dt[over]
            bodies = ice.take(over), ONE_STAGE, rubber.take(over)
            step = _in_one_stage(step, over, advance(*begins, *bodies, close=self.close))
        if self.tolerance is None:
            return Trial(step, np.isfinite(step.state.log_height), dt)
        weights = Weights(self.dry, SQUEEZED)
        error = end.local_error(step, ice, rubber, temperature_scale, weights)
        error /= method.allowed * self.tolerance
        factor = step_factor(error, method.estimate_order, GROW_ALONE)
        return Trial(step, error <= 1.0, dt * factor)


class Trial(NamedTuple):
    """A step, the mask of points where it is accepted, and the next step length (s)."""

    step: Step
    good: Mask
    following: Array


Parts = TypeVar("Parts", InterfaceState, FilmStage)


def _in_one_stage(step: Step, index: Index, other: Step) -> Step:
    """The step, with the `other` one of one stage at `index`; its local error is 0."""
    count = step.state.log_height.size

    def changed(whole: Parts, values: Parts) -> Parts:
        parts: list[Any] = []
        for part, new in zip(whole, values, strict=True):
            if part.shape[-1] == count:  # else it has no values
                part = part.copy()
                part[..., index] = new
            parts.append(part)
        return type(whole)(*parts)

    own = InterfaceState(*(step.integrator.diagonal * one for one in other.change))
    return step._replace(
        state=changed(step.state, other.state),
        stages=[changed(stage, other.last) for stage in step.stages],
        changes=[changed(change, own) for change in step.changes],
    )
