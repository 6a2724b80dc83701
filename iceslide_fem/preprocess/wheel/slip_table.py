"""mu of a wheel over its speed and its slip ratio, between rows that the brush has computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.contact import SlidingContact
from iceslide_fem.preprocess.wheel.friction import Tread, friction
from iceslide_fem.preprocess.wheel.rolling import Rolling
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

if TYPE_CHECKING:  # takes long to import, and only braking needs it
    from scipy.interpolate import RectBivariateSpline

KMH = 3.6
SPEEDS, SLIPS = 16, 41  # of a table for a stop


@dataclass(frozen=True)
class SlipTable:
    """mu (m, n) at rising speeds (m,), m/s, and rising slip ratios (n,), from 0 to 1.

    Between its rows and columns mu is bilinear. A wheel that rolls freely is not braked: mu is 0 at
    a slip ratio of 0. Raises SceneError if the table is none.
    """

    speeds: Array
    slips: Array
    mu: Array

    def __post_init__(self) -> None:
        """Refuse what cannot be interpolated."""
        for name, axis in (("speeds", self.speeds), ("slip ratios", self.slips)):
            if axis.ndim != 1 or axis.size < 2 or not (np.diff(axis) > 0.0).all():
                raise SceneError(f"a table of mu needs two or more rising {name}")
        if self.mu.shape != (self.speeds.size, self.slips.size):
            raise SceneError(
                f"a table of mu for {self.speeds.size} speeds and {self.slips.size} slip ratios "
                f"cannot have the shape {self.mu.shape}"
            )
        if self.slips[0] != 0.0 or self.slips[-1] != 1.0:
            raise SceneError(
                "the slip ratios of a table of mu go from 0 to 1; "
                f"given: {self.slips[0]:g} to {self.slips[-1]:g}"
            )
        if not (self.speeds[0] > 0.0 and np.isfinite(self.speeds[-1])):
            raise SceneError("the speeds of a table of mu are finite and above 0")
        if not (np.isfinite(self.mu).all() and (self.mu >= 0.0).all()):
            raise SceneError("mu of a table is a finite number of 0 or more")
        if self.mu[:, 0].any():
            raise SceneError("mu of a table is 0 at a slip ratio of 0: the wheel rolls freely")

    def __call__(self, speed: float, slip: float) -> float:
        """mu at a speed (m/s) and a slip ratio. Raises SceneError outside the table."""
        self.check_speed(speed)
        if not 0.0 <= slip <= 1.0:
            raise SceneError(f"a slip ratio of {slip:g} is outside the table of mu, 0 to 1")
        return self.inside(speed, slip)

    def check_speed(self, speed: float) -> None:
        """Raise SceneError if the table does not reach the speed (m/s)."""
        low, high = self.speeds[0], self.speeds[-1]
        if not low <= speed <= high:
            raise SceneError(
                f"a speed of {KMH * speed:.4g} km/h is outside the table of mu, "
                f"{KMH * low:.4g} to {KMH * high:.4g} km/h"
            )

    def inside(self, speed: float, slip: float) -> float:
        """mu at values that are known to be in the table; beyond its edges it is that of the edge.

        Trial stages of a solver may look past an edge by a part of their step.
        """
        return float(self._surface(speed, slip, grid=False))

    def peak(self, speed: float) -> tuple[float, float]:
        """Slip ratio of the largest mu at a speed (m/s) in the table, and that mu.

        At one speed mu is straight between columns, so that one of them has the largest.
        """
        row = self._surface(speed, self.slips)[0]
        largest = int(row.argmax())
        return float(self.slips[largest]), float(row[largest])

    @cached_property
    def _surface(self) -> RectBivariateSpline:
        from scipy.interpolate import RectBivariateSpline

        return RectBivariateSpline(self.speeds, self.slips, self.mu, kx=1, ky=1)


def axes_of_a_stop(speed: float, end_speed: float) -> tuple[Array, Array]:
    """Speeds (m/s, geometric steps) and slip ratios (even steps) for stops between two speeds.

    Distances are within 1 % of those by twice as many (docs/explanation/wheel.md). Raises
    SceneError if the speeds are not in their order.
    """
    if not 0.0 < end_speed < speed < np.inf:
        raise SceneError(
            f"braking from {KMH * speed:.4g} km/h to {KMH * end_speed:.4g} km/h is no braking to a "
            "lower speed above 0"
        )
    return np.geomspace(end_speed, speed, SPEEDS), np.linspace(0.0, 1.0, SLIPS)


def slip_table(
    footprint: PressureMap,
    speeds: Sequence[float] | Array,
    slips: Sequence[float] | Array,
    tread: Tread,
    contact: SlidingContact,
) -> SlipTable:
    """The table of a wheel with a `footprint` at all `speeds` (m/s) and `slips`, by `friction`.

    Raises SceneError if they are no axes of a table, SimulationStopped where the law finds no step.
    """

    def row(speed: float) -> list[float]:
        rolls = [Rolling(float(speed), float(slip)) for slip in slips]
        return [point.mu for point in friction(footprint, rolls, tread, contact)]

    mu = np.array([row(speed) for speed in speeds])
    return SlipTable(np.asarray(speeds, float), np.asarray(slips, float), mu)
