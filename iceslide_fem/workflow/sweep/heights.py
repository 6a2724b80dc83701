"""Film heights over time, for cases in which they do not follow from friction."""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.point import Conditions, Record
from iceslide_fem.runtime.arrays import Array


class SampledHeights:
    """Collects h (m) at `times` from accepted steps: `values`, (n, n_times), first at t = 0."""

    def __init__(self, conditions: Conditions, times: Array) -> None:
        """For films of the n `conditions`, at `times` (s, ascending from 0)."""
        self.values = np.repeat(conditions.initial_height[:, None], times.size, axis=1)
        self._times = times
        self._start = conditions.at_start.log_height.copy()
        self._next = np.ones(self._start.size, dtype=int)

    def add(self, record: Record) -> None:
        """Add samples within accepted steps.

        In a step ln h (with limiting shear ln(h + s)) is the parabola through its ends with the
        slope at its end.
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
