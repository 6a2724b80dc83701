"""How a load changes in time: a curve, its corners and its means over a run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve, SmoothCurve

if TYPE_CHECKING:  # slow to import, and only rows need it
    from scipy.interpolate import PPoly

_SAME = 1e-12  # tolerance of equal times, relative to the duration
# Largest deviation of loads from lines between the ends of steps, over the tolerance. mu follows
# speed and pressure instantly, so this is also its error.
SAMPLED = 0.3


@dataclass(frozen=True)
class Course:
    """A `curve` of values (SI) over time (s), for a run of `duration` (s).

    `within`: largest deviation of lines between kinks from the rows, relative to the largest value.
    """

    curve: Curve
    duration: float
    within: float = 0.0

    @property
    def is_constant(self) -> bool:
        """Whether it has one value throughout."""
        return self.curve.is_constant

    def __call__(self, time: ArrayLike) -> Array:
        """Value at `time` (s, any shape)."""
        return np.clip(self.curve(time), *self._range)  # against rounding

    def at(self, time: float) -> float:
        """Value at `time` (s)."""
        return self.curve.values[0] if self.is_constant else float(self(time))

    def slope(self, time: float) -> float:
        """Rate of change just before `time` (s), unit per s."""
        x = self.curve.x
        if not x[0] < time <= x[-1]:
            return 0.0
        before = np.searchsorted(x, time * (1.0 - _SAME)) - 1
        t, (c3, c2, c1, _) = time - x[before], self.curve.pieces[:, before]
        return float((3.0 * c3 * t + 2.0 * c2) * t + c1)

    def bend(self, time: float) -> float:
        """Jump of the rate of change at `time` (s), unit per s."""
        if self.is_constant or isinstance(self.curve, SmoothCurve):
            return 0.0
        slopes = np.concatenate([[0.0], self.curve.pieces[2], [0.0]])
        here = np.abs(self.curve.arrays[0] - time) <= _SAME * self.duration
        return float(np.diff(slopes) @ here)

    def integral(self, time: float) -> float:
        """Integral from 0 to `time` (s), exact."""
        if self.is_constant:
            return self.curve.values[0] * time
        return float(self._primitive(time)) - float(self._primitive(0.0))

    def mean_between(self, start: float, end: float) -> float:
        """Mean from `start` to `end` (s)."""
        if self.is_constant:
            return self.curve.values[0]
        mean = (self.integral(end) - self.integral(start)) / (end - start)
        low, high = self._range
        return min(max(mean, low), high)  # against rounding

    def next_corner(self, time: ArrayLike) -> Array:
        """The first row after `time` (s, any shape), infinite if there is none before the end."""
        t = np.asarray(time, dtype=float)
        later = np.searchsorted(self.corners, t + _SAME * self.duration, side="right")
        return np.append(self.corners, np.inf)[later]

    def sampled(self, within: float) -> Course:
        """The same with fewer kinks: a measured log has more rows than steps need."""
        return replace(self, within=within)

    @cached_property
    def corners(self) -> tuple[float, ...]:
        """Times of rows on which steps end, s; a row within rounding of the end is the end."""
        inside = self._times_inside
        if not self.within or len(inside) < 2:
            return inside
        times = np.array([0.0, *inside, self.duration])
        kept = _corners(times, self(times), self.within * max(self.curve.values))
        return tuple(times[kept[1:-1]].tolist())

    @cached_property
    def _times_inside(self) -> tuple[float, ...]:
        """All rows within the run, s."""
        end = self.duration * (1.0 - _SAME)
        return tuple(time for time in self.curve.x if 0.0 < time < end)

    @property
    def first(self) -> float:
        """Value at t = 0, where sliding begins."""
        return self.at(0.0)

    @property
    def mean(self) -> float:
        """Mean over the run."""
        return self.mean_between(0.0, self.duration)

    @property
    def largest(self) -> float:
        """Largest value within the run; it is at a row or an end (monotone between rows)."""
        return float(self._extremes.max())

    @property
    def smallest(self) -> float:
        """Smallest value within the run."""
        return float(self._extremes.min())

    @cached_property
    def _extremes(self) -> Array:
        """Values at rows and ends; they contain the extremes within the run."""
        return self(np.array([0.0, *self._times_inside, self.duration]))

    @cached_property
    def _range(self) -> tuple[float, float]:
        """Least and largest of all rows."""
        return min(self.curve.values), max(self.curve.values)

    @cached_property
    def _primitive(self) -> PPoly:
        """Primitive over the whole run, with the ends' values outside the rows."""
        from scipy.interpolate import PPoly

        x, values = self.curve.arrays
        ends = np.zeros((2, 4, 1))
        ends[:, -1, 0] = values[[0, -1]]
        pieces = np.hstack([ends[0], self.curve.pieces, ends[1]])
        beyond = min(x[0], 0.0) - 1.0, max(x[-1], self.duration) + 1.0
        return PPoly(pieces, np.array([beyond[0], *x, beyond[1]])).antiderivative()


def _corners(times: Array, values: Array, near: float) -> NDArray[np.intp]:
    """Numbers of rows, with the first and the last, that approximate all rows within `near`.

    From each row, the next one is the farthest whose line passes all rows between within `near`.
    """
    kept, count = [0], len(times)
    while kept[-1] < count - 1:
        start = kept[-1]
        furthest, low, high = start + 1, -np.inf, np.inf
        for row in range(start + 1, count):
            run, rise = times[row] - times[start], values[row] - values[start]
            if low <= rise / run <= high:
                furthest = row
            low, high = max(low, (rise - near) / run), min(high, (rise + near) / run)
            if low > high:
                break
        kept.append(furthest)
    return np.array(kept)
