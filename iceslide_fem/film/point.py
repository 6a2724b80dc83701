"""The point rung: the film law and the ice below it at one pressure, for many conditions at once.

Every condition has a time and a step of its own; steps end on melt onset and on saturation, so
that the integrator keeps its order through both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.arrays import Array, Index, Mask
from iceslide_fem.errors import SimulationStopped
from iceslide_fem.film.ice_heat import Column, HalfSpace
from iceslide_fem.film.integrators import (
    INTEGRATORS,
    Integrator,
    InterfaceState,
    Step,
    surface_excess,
)
from iceslide_fem.film.law import FilmLoads, interpolate, log_shearing
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat
from iceslide_fem.film.step_control import GROW_ALONE, StepControl, step_factor
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.materials import ViscosityTable

ICE_MODELS: dict[str, type[Column] | type[HalfSpace]] = {
    "column": Column,
    "half-space": HalfSpace,
}
# How closely a step ends on an event, relative to the tolerance.
EVENT_SHARE = 0.005
FIRST_STEP = 3e-4
# How closely ice by name answers with the modes that it is given, relative to the tolerance.
CONDENSED = 0.01
# The step after an event, relative to the one that ended on it.
RESTART = 0.03
SHORTEST_STEP = 1e-13  # of the duration


@dataclass
class PointResult:
    """Results of `simulate`; arrays (n,), times in s, NaN where something did not happen.

    mu_mean is the time average (5.35); samples holds mu at the sample times, (n_times, n).
    """

    mu_peak: Array
    mu_peak_time: Array
    mu_mean: Array
    mu_end: Array
    melt_onset: Array
    saturation: Array
    film_height: Array
    squeezed_height: Array
    steps: Index
    rejected: Index
    samples: Array

    @classmethod
    def at_start(cls, conditions: Conditions, times: Array) -> PointResult:
        """Results at t = 0, with room for mu at `times` (s)."""
        n = conditions.pressure.size
        mu = conditions.loads().viscous / (conditions.pressure * conditions.initial_height)
        samples = np.full((times.size, n), np.nan)
        samples[times <= 0.0] = mu
        return cls(
            mu_peak=mu.copy(),
            mu_peak_time=np.zeros(n),
            mu_mean=np.zeros(n),
            mu_end=mu,
            melt_onset=np.full(n, np.nan),
            saturation=np.full(n, np.nan),
            film_height=conditions.initial_height.copy(),
            squeezed_height=np.zeros(n),
            steps=np.zeros(n, dtype=int),
            rejected=np.zeros(n, dtype=int),
            samples=samples,
        )

    def _columns(self) -> Iterator[tuple[str, Any]]:
        """All results that are one number for each condition."""
        return ((f.name, getattr(self, f.name)) for f in fields(self) if f.name != "samples")

    def take(self, index: Index) -> PointResult:
        """The results of the conditions at `index` only, with all samples."""
        return PointResult(samples=self.samples, **{n: part[index] for n, part in self._columns()})

    def put(self, whole: PointResult, places: Index) -> None:
        """Enter these results, of the conditions at `places` of the `whole`."""
        for name, part in self._columns():
            getattr(whole, name)[places] = part


class Record(NamedTuple):
    """Accepted steps of the conditions `points`, found at `places` in all the other arrays.

    time: at the start of the step (s); dt: its length (s); loads: the film's at its end; step: the
    step; melting, full: where melting has begun and the free volume is full by the end of the step;
    pressure: nominal at its end (Pa); ice: the model whose content the step has.
    """

    points: Index
    places: Index
    time: Array
    dt: Array
    loads: FilmLoads
    step: Step
    melting: Mask
    full: Mask
    pressure: Array
    ice: Column | HalfSpace


class _Event(NamedTuple):
    """Fraction of the step at which melting or saturation sets in, 1 where neither does, and
    where the step ends on them."""

    fraction: Array
    melting: Mask
    full: Mask


def simulate(
    conditions: Conditions,
    ice: str | Column | HalfSpace = "column",
    tolerance: float = 1e-3,
    integrator: str | Integrator = "sdirk2",
    times: ArrayLike = (),
    fixed_step: float | None = None,
    max_step: float = np.inf,
    observe: Callable[[Record], None] | None = None,
    rubber: RubberHeat = INSULATED,
    loading: Loading | None = None,
    water: ViscosityTable | None = None,
) -> PointResult:
    """Integrate all `conditions` from t = 0 to their duration.

    `ice` is `column`, `half-space` or a model made for the conditions; `tolerance` the relative
    error of mu(t) aimed at; `integrator` one of `INTEGRATORS` or its name; `times` (s, ascending)
    where mu is sampled; `fixed_step` (s) replaces error control, `max_step` (s) bounds it;
    `observe` is called with every accepted step; `rubber` takes heat, too, if it is made of
    columns; with `loading` pressure and speed go in time, and steps end on its corners; with
    `water` the viscosity follows the film's temperature, and that of the conditions is replaced.
    Raises SimulationStopped where a step cannot be made, ValueError where an argument is not
    possible.
    """
    method = INTEGRATORS[integrator] if isinstance(integrator, str) else integrator
    if fixed_step is None and not method.estimate:
        raise ValueError("the integrator has no error estimate: give fixed_step")
    positive = {"tolerance": tolerance, "fixed_step": fixed_step, "max_step": max_step}
    for name, value in positive.items():
        if value is not None and not value > 0.0:
            raise ValueError(f"{name} = {value:g} is not possible; allowed: more than 0")
    if water is not None:
        conditions = conditions._replace(viscosity=water(conditions.temperature))
    n = conditions.pressure.size
    sample_times = np.asarray(times, dtype=float)
    if (np.diff(sample_times) < 0.0).any():
        raise ValueError("sample times must ascend")
    result = PointResult.at_start(conditions, sample_times)

    if isinstance(ice, str):
        ice = ICE_MODELS[ice](conditions.temperature, conditions.duration, solid=conditions.solid)
        ice = ice.condensed(CONDENSED * tolerance)
    heat = ice
    state = InterfaceState(
        np.log(conditions.initial_height),
        np.zeros(n),
        heat.initial(n),
        rubber.initial(n),
        np.zeros((0 if water is None else 1, n)),
    )
    here, loads = conditions, conditions.loads(water)
    scale = temperature_scale(here.melting_temperature - here.temperature, water)
    time = np.zeros(n)
    dt = FIRST_STEP * here.duration if fixed_step is None else np.full(n, fixed_step)
    control = StepControl(method, tolerance if fixed_step is None else None)
    # The conditions that still run, and their results so far.
    active, so_far = np.arange(n), result
    sampled = np.full(n, np.searchsorted(sample_times, 0.0, side="right"))

    while active.size:
        dt_try = np.minimum(np.minimum(dt, max_step), here.duration - time)
        ends, last = here, loads
        if loading is not None:
            dt_try = np.minimum(dt_try, loading.next_corner(time) - time)
            ends = loading.at(here, time + dt_try)
            last = ends.loads(water)
        step, good, wanted = control.trial(state, loads, last, dt_try, heat, scale, rubber)
        if loading is not None and fixed_step is None:
            bent = _bend(loads, loading.at(here, time + 0.5 * dt_try).loads(), last)
            good &= bent <= tolerance
            wanted = np.minimum(wanted, dt_try * step_factor(bent / tolerance, 2, GROW_ALONE))
            wanted = np.where(good, np.where(dt_try < dt, np.maximum(wanted, dt), wanted), wanted)
        on_ice = heat.surface_temperature(state.ice)
        heating = loads.viscous * loads.speed
        warmth = rubber.film_temperature(on_ice, state.rubber, heating, state)
        event = _events(step, state, warmth, ends, EVENT_SHARE * tolerance)
        fraction = event.fraction
        if fixed_step is None:
            # Across an event the error estimate means nothing; behind it the solution has a kink
            # that an estimate can overlook unless the steps grow from short ones again.
            begun = event.melting | event.full
            wanted = np.where(begun, np.minimum(wanted, RESTART * dt_try), wanted)
            dt = np.where(fraction < 1.0, fraction * dt_try, wanted)
            hopeless = dt < SHORTEST_STEP * here.duration
        else:
            dt = np.where(fraction < 1.0, fraction * dt_try, fixed_step)
            hopeless = fraction >= 1.0
        _refuse(~good & hopeless, dt_try, here, time)
        good &= fraction >= 1.0
        melting = event.melting | step.last.melting
        full = event.full | step.last.saturated
        places = np.flatnonzero(good)
        points, pressure = active[places], ends.pressure
        record = Record(points, places, time, dt_try, last, step, melting, full, pressure, heat)
        _note(so_far, record, good, loads.viscous / here.pressure)
        if sample_times.size:
            mu_end = so_far.mu_end
            _sample(result.samples, record, sampled, mu_end, here, state, sample_times, loading)
        if observe is not None and places.size:
            observe(record)
        time = np.where(good, time + dt_try, time)
        state = taken(state, step.state, good)
        if loading is not None:
            here = loading.at(here, time)
            loads = here.loads(water)
        running = time < here.duration * (1.0 - 1e-12)
        if not running.all():
            so_far.put(result, active)
            keep = np.flatnonzero(running)
            active, sampled, time, dt = active[keep], sampled[keep], time[keep], dt[keep]
            here, so_far, scale = here.take(keep), so_far.take(keep), scale[keep]
            loads = loads.take(keep)
            state = state.take(keep)
            heat, rubber = heat.take(keep), rubber.take(keep)
    result.mu_mean /= conditions.duration
    return result


def taken(old: InterfaceState, new: InterfaceState, good: Mask) -> InterfaceState:
    """The `new` state where the step is good, the `old` one elsewhere; `new` is overwritten."""
    bad = np.flatnonzero(~good)
    if bad.size:
        for before, after in zip(old, new, strict=True):
            after[..., bad] = before[..., bad]
    return new


def _events(
    step: Step, start: InterfaceState, warmth: Array, here: Conditions, share: float
) -> _Event:
    """What sets in during `step`, on the straight lines of the film's temperature and of H_s.

    `warmth` is that temperature (K) at the start of the step. A step that ends within `share` of
    an event (relative to T_m - T_0 and to H_V) ends on it.
    """
    slack = share * (here.melting_temperature - here.temperature)
    lack = here.melting_temperature - warmth
    melts, melted = _crossing(lack, surface_excess(step, here.melting_temperature), slack)
    slack = share * here.H_V
    fills, filled = _crossing(here.H_V - start.squeezed_height, step.last.overfill, slack)
    return _Event(np.maximum(np.minimum(melts, fills), 0.01), melted, filled)


def _crossing(before: Array, beyond: Array, slack: Array) -> tuple[Array, Mask]:
    """Fraction of the step that ends half a `slack` beyond the event, and whether it did."""
    ahead = before > slack
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = (before + 0.5 * slack) / (before + beyond)
    return np.where(ahead & (beyond > slack), fraction, 1.0), ahead & (np.abs(beyond) <= slack)


def _refuse(stuck: Mask, dt: Array, here: Conditions, time: Array) -> None:
    """Raise SimulationStopped if a step has failed that cannot be cut (any further)."""
    if stuck.any():
        i = int(np.argmax(stuck))
        raise SimulationStopped(
            f"the film at {here.pressure[i]:.4g} Pa and {here.speed[i]:.4g} m/s cannot be advanced "
            f"beyond t = {time[i]:.4g} s: a step of {dt[i]:.2g} s is too long for this integrator; "
            "take a shorter one, or an implicit integrator"
        )


def _note(result: PointResult, record: Record, good: Mask, shear: Array) -> None:
    """Enter the steps that are `good` into the results of the conditions that run.

    `shear` is k eta_0 v / p at the start of the step (m).
    """
    step, rejected = record.step, ~good
    t1, factor = record.time + record.dt, record.loads.viscous / record.pressure
    mu = factor * np.exp(log_shearing(step.state))
    work = record.dt * 0.5 * (factor + shear) * step.mean_shearing
    result.mu_mean += np.where(good, work, 0.0)
    higher = good & (mu > result.mu_peak)
    np.copyto(result.mu_peak, mu, where=higher)
    np.copyto(result.mu_peak_time, t1, where=higher)
    np.copyto(result.mu_end, mu, where=good)
    np.copyto(result.film_height, np.exp(step.state.log_height), where=good)
    np.copyto(result.squeezed_height, step.state.squeezed_height, where=good)
    result.steps += good
    result.rejected += rejected
    for times, switch in (
        (result.melt_onset, record.melting),
        (result.saturation, record.full),
    ):
        np.copyto(times, t1, where=good & switch & np.isnan(times))


def _sample(
    samples: Array,
    record: Record,
    sampled: Index,
    mu_end: Array,
    here: Conditions,
    start: InterfaceState,
    times: Array,
    loading: Loading | None,
) -> None:
    """Enter mu at the `times` (s) that fall into accepted steps, of which `mu_end` is the last.

    `sampled` counts the times that have been entered.
    """
    step, at, end = record.step, record.places, record.time + record.dt
    count = np.searchsorted(times, end[at], side="right") - sampled[at]
    place = np.repeat(at, count)
    if not place.size:
        return
    first = np.cumsum(count) - count
    which = np.arange(place.size) + np.repeat(sampled[at] - first, count)
    sampled[at] += count
    # ln(eta / h) within a step: the parabola with its ends and its slope at the end.
    rate = step.shearing_rate
    bend = (log_shearing(start) - log_shearing(step.state) + rate * record.dt) / record.dt**2
    left = end[place] - times[which]
    mu = mu_end[place] * np.exp(left * (left * bend[place] - rate[place]))
    if loading is not None:
        then = loading.at(here.take(place), times[which])
        mu *= then.loads().viscous / then.pressure
        mu /= (record.loads.viscous / record.pressure)[place]
    flat = which * samples.shape[1] + np.repeat(record.points, count)
    samples.reshape(-1)[flat] = mu


def _bend(start: FilmLoads, middle: FilmLoads, end: FilmLoads) -> Array:
    """How far loads in the middle of a step are from the line between its ends, relative."""
    line = interpolate(start, end, 0.5)
    gaps = (
        np.abs(getattr(middle, name) - getattr(line, name))
        / np.maximum(np.abs(getattr(end, name)), np.abs(getattr(start, name)) + 1e-300)
        for name in ("viscous", "squeeze_rate")
    )
    return np.maximum(*gaps)
