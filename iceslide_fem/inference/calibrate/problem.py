"""The residual of a calibration: ln of computed over measured friction, for many parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from iceslide_fem.inference.calibrate.measured import Measured
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.scene import Scene
from iceslide_fem.scene.variation import with_values

DIFFERENCE = 1e-2  # of ln p, to each side


class Fitted(NamedTuple):
    """A parameter that is fitted: key, unit, and bounds and start, SI."""

    key: str
    unit: str
    low: float
    high: float
    start: float


class Problem:
    """Residuals r = ln(mu_computed / mu_measured) / sigma, over z = ln p.

    A series counts as one row: the residuals of its times are divided by the root of their number.
    """

    def __init__(
        self, scene: Scene, measured: Measured, parameters: tuple[Fitted, ...], output: str
    ) -> None:
        """For the `parameters` of a point `scene`; output: of `many_points.OUTPUTS`."""
        self.scene, self.measured, self.parameters = scene, measured, parameters
        self._output = output
        self.low, self.high, self.start = (
            np.log([getattr(one, name) for one in parameters]) for name in ("low", "high", "start")
        )
        self.points = 0  # computed so far
        self._last: tuple[bytes, Array, Array] | None = None

    def computed(self, z: Array) -> Array:
        """ln mu of every measured value for parameters `z` (m, p); (m, values).

        Raises SimulationStopped if the point model finds no answer.
        """
        scenes = [with_values(self.scene, self.values(one)) for one in np.atleast_2d(z)]
        series = self.measured.series
        times = () if series is None else series.times
        found = friction(scenes, self.measured.rows, times)
        self.points += len(scenes) * self.measured.number
        if found.failures:
            (number, row), reason = next(iter(found.failures.items()))
            values = ", ".join(f"{k} = {v:g}" for k, v in self.values(z[number]).items())
            raise SimulationStopped(f"row {row + 1} with {values}: {reason}")
        mu = getattr(found, self._output) if series is None else found.samples[:, self._there]
        return np.asarray(np.log(np.maximum(mu, 1e-12)))

    @property
    def _there(self) -> Array:
        """Which values of the series are measured, (n, times)."""
        series = self.measured.series
        assert series is not None
        return np.isfinite(series.mu)

    @property
    def row_of_value(self) -> Index:
        """The row of every measured value, (values,)."""
        n = self.measured.number
        if self.measured.series is None:
            return np.arange(n)
        return np.nonzero(self._there)[0]

    @property
    def ln_measured(self) -> Array:
        """ln of every measured value, (values,)."""
        series = self.measured.series
        return np.log(self.measured.mu if series is None else series.mu[self._there])

    @property
    def scale(self) -> Array:
        """sigma of every measured value, (values,)."""
        row = self.row_of_value
        return self.measured.sigma[row] * np.sqrt(np.bincount(row)[row])

    def residuals(self, z: Array) -> tuple[Array, Array]:
        """r (values,) and its derivatives by z (values, p), by central differences in one call."""
        if self._last is not None and self._last[0] == z.tobytes():
            return self._last[1:]
        p = z.size
        steps = DIFFERENCE * np.concatenate([np.zeros((1, p)), np.eye(p), -np.eye(p)])
        ln_mu = self.computed(z + steps)
        r = (ln_mu[0] - self.ln_measured) / self.scale
        slope = (ln_mu[1 : p + 1] - ln_mu[p + 1 :]).T / (2.0 * DIFFERENCE) / self.scale[:, None]
        self._last = z.tobytes(), r, slope
        return r, slope

    @property
    def mu_measured(self) -> Array:
        """Every measured value, (values,)."""
        return np.exp(self.ln_measured)

    def mu(self, residuals: Array) -> Array:
        """Computed mu with these `residuals`, (values,)."""
        return np.asarray(np.exp(self.ln_measured + residuals * self.scale))

    def values(self, z: Array) -> dict[str, float]:
        """Values (SI) by key."""
        return {one.key: float(v) for one, v in zip(self.parameters, np.exp(z), strict=True)}


def fitted(scene: Scene, asked: Mapping[str, str]) -> tuple[Fitted, ...]:
    """The parameters `asked` for: bounds "low:high" by key. Raises SceneError."""
    from iceslide_fem.inference.parameters import bounds_of

    found = []
    for key, text in asked.items():
        parameter, low, high, start = bounds_of(scene, key, text)
        if not low > 0.0:
            raise SceneError(f'--fit {key}="{text}" begins at {low:g}; allowed: more than 0')
        found.append(Fitted(key, parameter.unit, low, high, start))
    return tuple(found)
