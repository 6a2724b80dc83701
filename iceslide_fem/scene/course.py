"""How a load goes in time: rows of times and values, straight or smooth between, and its integral.

Before the first row and after the last their values hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.arrays import Array

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

# scipy.interpolate takes longer to import than most scenes take to read: only tables need it.
_SAME = 1e-12  # of times, relative to the duration


@dataclass(frozen=True)
class Course:
    """Values (SI) at ascending `times` (s), for a run of `duration` (s).

    Between rows `smooth` is a monotone cubic (PCHIP, level at both ends: continuous slope, no
    overshoot), else straight lines. One value without times holds throughout.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]
    duration: float
    smooth: bool = False

    @property
    def is_constant(self) -> bool:
        """Whether it has one value throughout."""
        return len(self.values) == 1

    def __call__(self, time: ArrayLike) -> Array:
        """Value at `time` (s, any shape)."""
        t = np.asarray(time, dtype=float)
        if self.is_constant:
            return np.full_like(t, self.values[0])
        inside = self._pieces(np.clip(t, self.times[0], self.times[-1]))
        inside = np.clip(inside, min(self.values), max(self.values))  # rounding apart, it is so
        return np.where(t < self.times[-1], inside, self.values[-1])

    def at(self, time: float) -> float:
        """Value at `time` (s)."""
        return self.values[0] if self.is_constant else float(self(time))

    def slope(self, time: float) -> float:
        """Its rate of change just before `time` (s), 1/s of its unit."""
        if self.is_constant or not self.times[0] < time <= self.times[-1]:
            return 0.0
        before = np.searchsorted(self.times, time * (1.0 - _SAME)) - 1
        t, (c3, c2, c1, _) = time - self.times[before], self._cubic[:, before]
        return float((3.0 * c3 * t + 2.0 * c2) * t + c1)

    def bend(self, time: float) -> float:
        """By how much its rate of change jumps at `time` (s), 1/s of its unit."""
        if self.is_constant or self.smooth:
            return 0.0
        slopes = np.concatenate([[0.0], np.diff(self.values) / np.diff(self.times), [0.0]])
        here = np.abs(np.array(self.times) - time) <= _SAME * self.duration
        return float(np.diff(slopes) @ here)

    def integral(self, time: float) -> float:
        """Integral from 0 to `time` (s), exact."""
        if self.is_constant:
            return self.values[0] * time
        return float(self._primitive(time)) - float(self._primitive(0.0))

    def mean_between(self, start: float, end: float) -> float:
        """Mean from `start` to `end` (s)."""
        if self.is_constant:
            return self.values[0]
        mean = (self.integral(end) - self.integral(start)) / (end - start)
        return min(max(mean, min(self.values)), max(self.values))  # rounding apart, it is so

    def next_corner(self, time: ArrayLike) -> Array:
        """The first row after `time` (s, any shape), infinite if there is none before the end."""
        t = np.asarray(time, dtype=float)
        if self.is_constant:
            return np.full_like(t, np.inf)
        later = np.searchsorted(self.corners, t + _SAME * self.duration, side="right")
        return np.append(self.corners, np.inf)[later]

    @cached_property
    def corners(self) -> tuple[float, ...]:
        """Rows within the run, s; one that is a rounding before the end is the end."""
        end = self.duration * (1.0 - _SAME)
        return tuple(time for time in self.times if 0.0 < time < end)

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
        """Largest value within the run: monotone between rows, so at one of them or an end."""
        return max(self.at(time) for time in (0.0, *self.corners, self.duration))

    @property
    def smallest(self) -> float:
        """Smallest value within the run."""
        return min(self.at(time) for time in (0.0, *self.corners, self.duration))

    @cached_property
    def _cubic(self) -> Array:
        """Coefficients of the pieces, highest power first, (4, rows - 1)."""
        if self.smooth:
            from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

            slopes = np.zeros(len(self.times))  # at the ends, beyond which their values hold
            if len(self.times) > 2:
                slopes[1:-1] = PchipInterpolator(self.times, self.values)(self.times[1:-1], 1)
            return np.asarray(CubicHermiteSpline(self.times, self.values, slopes).c)
        slopes = np.diff(self.values) / np.diff(self.times)
        nothing = np.zeros_like(slopes)
        return np.stack([nothing, nothing, slopes, np.array(self.values[:-1])])

    @cached_property
    def _pieces(self) -> PPoly:
        from scipy.interpolate import PPoly

        return PPoly(self._cubic, self.times)

    @cached_property
    def _primitive(self) -> PPoly:
        """Primitive over the whole run, with the ends' values outside the rows."""
        from scipy.interpolate import PPoly

        ends = np.array([min(self.times[0], 0.0) - 1.0, max(self.times[-1], self.duration) + 1.0])
        held = np.zeros((4, 1))
        first, last = held.copy(), held.copy()
        first[-1], last[-1] = self.values[0], self.values[-1]
        pieces = np.hstack([first, self._cubic, last])
        return PPoly(pieces, np.concatenate([ends[:1], self.times, ends[1:]])).antiderivative()
