"""mu of a wheel over speed and slip ratio, interpolated from results of the brush model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.contact import SlidingContact
from iceslide_fem.preprocess.wheel.friction import calls_for, friction
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

if TYPE_CHECKING:  # slow import, needed for braking only
    from scipy.interpolate import RectBivariateSpline

KMH = 3.6
SPEEDS, SLIPS = 12, 41  # size of a table for a stop
SMALLEST = 2.5e-3  # slip ratio above 0: below the peak of dry friction
ROOM = 1.2  # of the first speed: other starts of the same stop are above it


@dataclass(frozen=True)
class SlipTable:
    """mu (m, n) at ascending speeds (m,), m/s, and ascending slip ratios (n,) from 0 to 1.

    mu is bilinear between rows and columns. At a slip ratio of 0 (free rolling) mu is 0. Raises
    SceneError for an invalid table.
    """

    speeds: Array
    slips: Array
    mu: Array

    def __post_init__(self) -> None:
        """Validate the table."""
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
        """mu at values in the table; constant beyond its edges.

        Trial stages of a solver may be outside by a part of their step.
        """
        return float(self._surface(speed, slip, grid=False))

    def peak(self, speed: float) -> tuple[float, float]:
        """Slip ratio of the largest mu at a speed (m/s) in the table, and that mu.

        At one speed mu is linear between columns, so the maximum is at a column.
        """
        row = self._surface(speed, self.slips)[0]
        largest = int(row.argmax())
        return float(self.slips[largest]), float(row[largest])

    @cached_property
    def _surface(self) -> RectBivariateSpline:
        from scipy.interpolate import RectBivariateSpline

        return RectBivariateSpline(self.speeds, self.slips, self.mu, kx=1, ky=1)


def axes_of_a_stop(speed: float, end_speed: float) -> tuple[Array, Array]:
    """Speeds (m/s) and slip ratios, both in geometric steps, for stops between two speeds.

    The speeds reach beyond the first one, by `ROOM`. Raises SceneError if their order is wrong.
    """
    if not 0.0 < end_speed < speed < np.inf:
        raise SceneError(
            f"braking from {KMH * speed:.4g} km/h to {KMH * end_speed:.4g} km/h is no braking to a "
            "lower speed above 0"
        )
    return np.geomspace(end_speed, ROOM * speed, SPEEDS), slips_of_a_stop()


def slips_of_a_stop() -> Array:
    """0, and slip ratios to 1 in geometric steps: the peak of dry friction is at a few percent."""
    return np.concatenate([[0.0], np.geomspace(SMALLEST, 1.0, SLIPS - 1)])


def slip_table(
    footprint: PressureMap,
    speeds: Sequence[float] | Array,
    slips: Sequence[float] | Array,
    tread: Tread,
    contact: SlidingContact,
) -> SlipTable:
    """The table of a wheel with a `footprint` at all `speeds` (m/s) and `slips`, by `friction`.

    Raises SceneError if they are invalid axes, SimulationStopped if a step fails.
    """
    rolls = [Rolling(float(speed), float(slip)) for speed in speeds for slip in slips]
    mu: list[float] = []
    for some in np.array_split(np.arange(len(rolls)), calls_for(len(rolls), footprint, tread)):
        found = friction(footprint, [rolls[number] for number in some], tread, contact)
        mu += [point.mu for point in found]
    return SlipTable(
        np.asarray(speeds, float),
        np.asarray(slips, float),
        np.reshape(mu, (len(speeds), len(slips))),
    )
