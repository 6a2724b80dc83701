"""Point cases of a sweep: all of them in one vectorised call."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import monotonic
from typing import Any

import numpy as np

from iceslide_fem.film.conditions import rubber_columns, scene_conditions, simulation_settings
from iceslide_fem.film.point import Conditions, Record, simulate
from iceslide_fem.output.table import PassRow
from iceslide_fem.runs.many_points import CHUNK, shared_by
from iceslide_fem.runs.point import point_doubts, point_history, point_summary
from iceslide_fem.runs.point_pass import imbalances
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene
from iceslide_fem.scene.fingerprint import versions
from iceslide_fem.workflow.sweep.table import CURVES, DONE, FAILED, SAMPLES, CaseResult


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


def simulate_points(scenes: Sequence[Scene]) -> list[CaseResult]:
    """Outcomes of point scenes, in order.

    Scenes on attached ice with equal duration share a call, where `shared_by` allows it. If a call
    fails, its scenes are bisected until the failing one is alone.
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    outcomes: list[CaseResult] = [CaseResult(FAILED)] * len(scenes)
    for number, scene in enumerate(scenes):
        together = shared_by(scene)
        # On sliding ice each scene has its transit time, and its curves are a block's. Heights of
        # films whose water changes its viscosity do not follow from mu.
        curves = scene.ice.motion == "sliding" or scene.water.table is not None
        if together is None or curves:
            outcomes[number] = _alone(scene)
        else:
            groups.setdefault((scene.load.duration, *together), []).append(number)
    for numbers in groups.values():
        for first in range(0, len(numbers), CHUNK):
            chunk = numbers[first : first + CHUNK]
            for number, outcome in zip(chunk, _outcomes([scenes[i] for i in chunk]), strict=True):
                outcomes[number] = outcome
    return outcomes


def _alone(scene: Scene) -> CaseResult:
    """Outcome of a scene in a separate call."""
    started, passes = monotonic(), list[PassRow]()
    try:
        rows, entries = point_history(scene, passes.append)
    except SimulationStopped as reason:
        return CaseResult(FAILED, str(reason))
    times = np.linspace(0.0, scene.load.duration, SAMPLES)
    start = 0.0
    if passes:  # curves of the last pass
        start = passes[-1].start_s
        rows = rows[-passes[-1].steps - 1 :]
    own = [row.time_s - start for row in rows]
    curves = {name: np.interp(times, own, [getattr(row, name) for row in rows]) for name in CURVES}
    return CaseResult(DONE, "", entries | {"wall_s": monotonic() - started}, curves)


def _outcomes(scenes: list[Scene]) -> Iterator[CaseResult]:
    try:
        yield from _together(scenes)
    except SimulationStopped as reason:
        if len(scenes) == 1:
            yield CaseResult(FAILED, str(reason))
            return
        half = len(scenes) // 2
        yield from _outcomes(scenes[:half])
        yield from _outcomes(scenes[half:])


def _together(scenes: list[Scene]) -> list[CaseResult]:
    """Outcomes of scenes with the same settings and duration, by one call."""
    started = monotonic()
    parts = [scene_conditions(scene) for scene in scenes]
    conditions = Conditions.together(parts)
    times = np.linspace(0.0, scenes[0].load.duration, SAMPLES)
    work, into_ice, into_rubber, lost = np.zeros((4, len(scenes)))  # J/m2

    settings = simulation_settings(scenes[0])
    loading = settings["loading"]
    # Heights follow from mu.
    follows = conditions.limit is None and conditions.hysteresis is None and loading is None
    heights = None if follows else SampledHeights(conditions, times)

    def add(record: Record) -> None:
        step, at = record.step, record.places
        work[record.points] += step.friction_work[at]
        into_ice[record.points] += step.ice_heat[at]
        into_rubber[record.points] += step.rubber_heat[at]
        lost[record.points] += step.hysteresis_heat[at]
        if heights is not None:
            heights.add(record)

    rubber = rubber_columns(scenes[0])
    result = simulate(conditions, times=times, observe=add, rubber=rubber, **settings)
    mu: Array = result.samples.T
    mu[:, -1] = result.mu_end  # the last step may end early by rounding
    if heights is None:
        height = (conditions.loads().viscous / conditions.pressure)[:, None] / mu
    else:
        height = heights.values
        height[:, -1] = result.film_height
    there = result.film_height + result.squeezed_height
    latent, melted = conditions.solid.melting_enthalpy, there - conditions.initial_height
    heats = into_ice, into_rubber, latent * melted, lost
    missing = imbalances(work, heats, latent * there)
    wall = (monotonic() - started) / len(scenes)
    outcomes = []
    for i in range(len(scenes)):
        entries = point_summary(result, i) | {
            "energy_imbalance": float(missing[i]),
            "wall_s": wall,
            "warnings": point_doubts(result, i, conditions.limit is not None),
            "versions": versions(),
        }
        outcomes.append(CaseResult(DONE, "", entries, {"mu": mu[i], "film_height_m": height[i]}))
    return outcomes
