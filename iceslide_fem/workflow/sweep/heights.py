"""Heights of films over time, where they do not follow from friction."""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.point import Conditions, Record
from iceslide_fem.runtime.arrays import Array


class SampledHeights:
    """h (m) at `times` as accepted steps come in: `values`, (n, n_times), the first at t = 0."""

    def __init__(self, conditions: Conditions, times: Array) -> None:
        """Of films of the n `conditions`, at `times` (s, ascending from 0)."""
        self.values = np.repeat(conditions.initial_height[:, None], times.size, axis=1)
        self._times = times
        self._start = conditions.at_start.log_height.copy()
        self._next = np.ones(self._start.size, dtype=int)

    def add(self, record: Record) -> None:
        """Enter what falls into accepted steps, in each the parabola of ln h (with a limit of the
        shear ln(h + s)) with its ends and its slope at the end.
        """
        at, points, step = record.places, record.points, record.step
        dt = record.dt[at]
        end = record.time[at] + dt
        last, rate = step.state.log_height[at], (step.change.log_height / step.stage_dt)[at]
        bend = (self._start[points] - last + rate * dt) / dt**2
        first, after = self._next[points], np.searchsorted(self._times, end, side="right")
        count = after - first
        run = np.repeat(np.arange(count.size), count)
        which = np.arange(run.size) - (np.cumsum(count) - count - first)[run]
        left = end[run] - self._times[which]
        sampled = last[run] - left * (rate[run] - left * bend[run])
        self.values[points[run], which] = record.loads.take(at[run]).height(sampled)
        self._start[points], self._next[points] = last, after
