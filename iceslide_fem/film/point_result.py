"""Results of points, and how accepted steps add to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.driving import PointLoads
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step, weighted
from iceslide_fem.film.law import log_shearing
from iceslide_fem.runtime.arrays import Array, Index, Mask


@dataclass
class PointResult:
    """Results of `simulate`; arrays (n,), times in s, NaN for events that do not occur.

    mu_mean is the time average (5.35); samples holds mu at the sample times, (n_times, n);
    peak_shearing is tau / c at the peak, 1/m; state is that of films and ice at the end.
    """

    mu_peak: Array
    mu_peak_time: Array
    peak_shearing: Array
    mu_mean: Array
    mu_end: Array
    melt_onset: Array
    saturation: Array
    film_height: Array
    squeezed_height: Array
    steps: Index
    rejected: Index
    samples: Array
    state: InterfaceState

    @classmethod
    def at_start(
        cls, mu: Array, state: InterfaceState, loads: PointLoads, times: Array
    ) -> PointResult:
        """Results of films in `state` at t = 0, with room for mu at `times` (s)."""
        n = mu.size
        samples = np.full((n, times.size), np.nan)  # samples of a point are contiguous
        samples[:, times <= 0.0] = mu[:, None]
        return cls(
            mu_peak=mu.copy(),
            mu_peak_time=np.zeros(n),
            peak_shearing=np.exp(log_shearing(state)),
            mu_mean=np.zeros(n),
            mu_end=mu,
            melt_onset=np.full(n, np.nan),
            saturation=np.full(n, np.nan),
            film_height=loads.height(state.log_height),
            squeezed_height=state.squeezed_height.copy(),
            steps=np.zeros(n, dtype=int),
            rejected=np.zeros(n, dtype=int),
            samples=samples.T,
            state=InterfaceState(*(part.copy() for part in state)),
        )


class Record(NamedTuple):
    """A trial step of all running conditions, with the mask of accepted ones.

    active: numbers of these conditions; good: mask of accepted steps; time: at its start (s); dt:
    its length (s); loads: film loads at its end; step: the step; melting, full: masks of begun
    melting and full free volume at its end; pressure: nominal at its end (Pa); ice: model of the
    step's heat state.
    """

    active: Index
    good: Mask
    time: Array
    dt: Array
    loads: PointLoads
    step: Step
    melting: Mask
    full: Mask
    pressure: Array
    ice: Column | HalfSpace
    state: InterfaceState

    @property
    def places(self) -> Index:
        """Positions of the accepted steps in the arrays."""
        return np.flatnonzero(self.good)

    @property
    def points(self) -> Index:
        """Numbers of their conditions."""
        return self.active[self.good]


class _Sums(NamedTuple):
    """Running sums of the conditions: peak of mu and its time (s), the sum of mu dt (s), numbers of
    steps and samples, and whether melting and saturation have occurred.
    """

    peak: Array
    peak_time: Array
    peak_shearing: Array
    work: Array
    steps: Index
    sampled: Index
    molten: Mask
    filled: Mask

    def take(self, index: Index) -> _Sums:
        """The sums of the conditions at `index`."""
        parts: tuple[Any, ...] = self
        return _Sums(*(part.take(index, mode="clip") for part in parts))


class Tally:
    """Collects the results of many conditions step by step."""

    def __init__(self, result: PointResult, duration: Array, times: Array) -> None:
        """`result` is that at t = 0, for mu at `times` (s, ascending) until the `duration` (s)."""
        self.result, self._times, self._duration = result, times, duration
        n, self._tried = result.mu_end.size, 0
        self._sums = _Sums(
            result.mu_peak.copy(),
            np.zeros(n),
            result.peak_shearing.copy(),
            np.zeros(n),
            np.zeros(n, dtype=int),
            np.full(n, np.searchsorted(times, 0.0, side="right")),
            np.zeros(n, dtype=bool),
            np.zeros(n, dtype=bool),
        )

    def add(
        self, record: Record, start: InterfaceState, first: PointLoads, pressure: Array
    ) -> Array:
        """Add accepted steps from `start`; returns mu at their ends.

        first: loads at the starts; pressure: nominal there, Pa.
        """
        sums, step, good = self._sums, record.step, record.good
        self._tried += 1
        end = record.time + record.dt
        mu = record.loads.stress(step.last) / record.pressure
        mean = _mean_friction(record, first, pressure) * record.dt
        higher = mu > sums.peak
        refused = np.flatnonzero(~good)
        mean[refused], higher[refused] = 0.0, False
        sums.work[:] += mean
        sums.peak[:] = np.where(higher, mu, sums.peak)
        sums.peak_time[:] = np.where(higher, end, sums.peak_time)
        sums.peak_shearing[:] = np.where(higher, step.last.shearing, sums.peak_shearing)
        sums.steps[:] += good
        for times, switch, seen in (
            (self.result.melt_onset, record.melting, sums.molten),
            (self.result.saturation, record.full, sums.filled),
        ):
            fresh = good & switch & ~seen
            if fresh.any():
                seen |= fresh
                times[record.active[fresh]] = end[fresh]
        if self._times.size:
            self._sample(record, start, first, pressure, end, mu)
        return mu

    def finish(self, record: Record, state: InterfaceState, mu: Array, running: Mask) -> None:
        """Store the results of finished conditions; keep the `running` ones."""
        sums, result = self._sums, self.result
        over = np.flatnonzero(~running)
        points = record.active[over]
        result.mu_peak[points] = sums.peak[over]
        result.mu_peak_time[points] = sums.peak_time[over]
        result.peak_shearing[points] = sums.peak_shearing[over]
        result.mu_mean[points] = sums.work[over] / self._duration[points]
        result.mu_end[points] = mu[over]
        result.film_height[points] = record.loads.height(state.log_height)[over]
        result.squeezed_height[points] = state.squeezed_height[over]
        for whole, part in zip(result.state, state, strict=True):
            whole[..., points] = part[..., over]
        result.steps[points] = sums.steps[over]
        result.rejected[points] = self._tried - sums.steps[over]
        keep = np.flatnonzero(running)
        self._sums = sums.take(keep)

    def _sample(
        self,
        record: Record,
        start: InterfaceState,
        first: PointLoads,
        pressure: Array,
        end: Array,
        mu_end: Array,
    ) -> None:
        """Store mu at the sample times within accepted steps; mu_end: at the steps' ends.

        In a step ln(tau / c) is a parabola and c / p is linear.
        """
        sampled, times, step = self._sums.sampled, self._times, record.step
        count = np.searchsorted(times, end, side="right")
        count -= sampled
        count *= record.good
        before = sampled - np.cumsum(count)
        sampled += count
        before += count
        run = np.repeat(np.arange(count.size), count)
        if not run.size:
            return

        def of_samples(of_steps: Any) -> Any:
            """Values per step, repeated for the samples of the step."""
            return of_steps.take(run, mode="clip")

        which = np.arange(run.size)
        which += of_samples(before)
        # ln(eta / h) within a step: the parabola through its ends with its slope at the end.
        rate, dt = step.shearing_rate, record.dt
        bend = rate * dt
        bend += log_shearing(start)
        bend -= log_shearing(step.state)
        bend /= dt * dt
        left = of_samples(end)
        left -= times.take(which, mode="clip")
        mu = of_samples(bend)
        mu *= left
        mu -= of_samples(rate)
        mu *= left
        np.exp(mu, out=mu)
        mu *= of_samples(mu_end)
        if first is not record.loads:
            c, p = record.loads.viscous, record.pressure
            growth = (first.viscous / pressure) / (c / p) - 1.0
            mu *= 1.0 + of_samples(growth) * left / of_samples(dt)
        which += of_samples(record.active * times.size)
        self.result.samples.T.reshape(-1)[which] = mu


def _mean_friction(record: Record, first: PointLoads, pressure: Array) -> Array:
    """Mean of mu = tau / p over steps, by their weights.

    first: loads at the starts; pressure: nominal there, Pa.
    """
    step, last = record.step, record.loads
    if first is last:
        stresses = [last.stress(stage) for stage in step.stages]
        return weighted(step.weights, stresses) / record.pressure
    found = []
    for stage, node in zip(step.stages, step.integrator.nodes, strict=True):
        p = pressure + node * (record.pressure - pressure)
        found.append(first.at(last, node).stress(stage) / p)
    return weighted(step.weights, found)
