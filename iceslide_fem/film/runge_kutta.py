"""Runge-Kutta methods, by their coefficients.

All are diagonally implicit with one diagonal coefficient, and end on their last stage.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.law import FilmStage, explicit_stage, implicit_stage


class Integrator(NamedTuple):
    """Butcher coefficients: `rows` of the matrix left of the diagonal, `diagonal` on it.

    `estimate` holds b - b_hat, the weights that give the local error; empty if the method has
    none and runs at fixed steps. `order` is that of the solution kept, `estimate_order` the
    power of the step with which the estimate falls; `allowed` the local error allowed per step
    relative to the error wanted of mu(t), as measured. `stage` is the film law's stage.
    """

    diagonal: float
    rows: tuple[tuple[float, ...], ...]
    estimate: tuple[float, ...]
    order: int
    estimate_order: int
    allowed: float = 1.0
    stage: Callable[..., FilmStage] = implicit_stage

    @property
    def weights(self) -> tuple[float, ...]:
        """b: the last row of the matrix."""
        return (*self.rows[-1], self.diagonal)

    @property
    def nodes(self) -> tuple[float, ...]:
        """c: the times of the stages as fractions of the step."""
        return tuple(sum(row) + self.diagonal for row in self.rows)


def _sdirk2() -> Integrator:
    """Two stages, order 2, L-stable (Alexander 1977); estimate against implicit Euler."""
    g = 1.0 - 1.0 / np.sqrt(2.0)
    return Integrator(g, ((), (1.0 - g,)), (-g, g), order=2, estimate_order=2, allowed=0.5)


def _sdirk3() -> Integrator:
    """Three stages, order 3, L-stable (Alexander 1977); estimate against an order 2 method."""
    g = 0.4358665215084590
    b1 = -(6.0 * g**2 - 16.0 * g + 1.0) / 4.0
    b2 = (6.0 * g**2 - 20.0 * g + 5.0) / 4.0
    c2 = (1.0 + g) / 2.0
    # The order 2 companion uses the first two stages: b1^ + b2^ = 1, b1^ g + b2^ c2 = 1/2.
    b2_hat = (0.5 - g) / (c2 - g)
    estimate = (b1 - (1.0 - b2_hat), b2 - b2_hat, g)
    rows = ((), ((1.0 - g) / 2.0,), (b1, b2))
    return Integrator(g, rows, estimate, order=3, estimate_order=3, allowed=0.1)


INTEGRATORS = {
    "sdirk2": _sdirk2(),
    "sdirk3": _sdirk3(),
    "implicit-euler": Integrator(1.0, ((),), (), order=1, estimate_order=1),
    "explicit-euler": Integrator(1.0, ((),), (), order=1, estimate_order=1, stage=explicit_stage),
}
