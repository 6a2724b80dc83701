"""The point rung: the film law and the ice below it at one pressure, for many conditions at once.

Every condition has a time and a step of its own; steps end on melt onset and on saturation, so
that the integrator keeps its order through both.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import INTEGRATORS, Integrator, InterfaceState
from iceslide_fem.film.loads import FilmLoads, interpolate
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.point_events import Warmth, events, onset_below, until
from iceslide_fem.film.point_result import PointResult, Record, Tally
from iceslide_fem.film.rubber_heat import INSULATED, Insulated, RubberHeat
from iceslide_fem.film.step_control import DRY, GROW_ALONE, StepControl, close_enough, step_factor
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.materials import BOTTOMLESS, Ground, Solid, ViscosityTable

ICE_MODELS = ("column", "half-space")
# How closely a step ends on an event, relative to the tolerance.
EVENT_SHARE = 0.005
# That of the half-space, whose flux jumps at the onset: mu turns there within a hundredth of the
# time that it took, and so errors of that time count more, and errors of a dry film with them.
JUMP = 0.2
# So often a step is cut to where a straight line meets the event; then to a half at most.
LINES = 2
# Relative to the duration and to the tolerance.
FIRST_STEP = 0.05
# Local errors of surface temperatures count so many times less than those of mu: conduction takes
# them away, and the heat that has come in has no part in them.
SURFACE_EASE = 8.0
# How closely ice by name answers with the modes that it is given, relative to the tolerance.
CONDENSED = 0.005
# The step after an event, relative to what the error asked for before.
RESTART = 0.01
SHORTEST_STEP = 1e-13  # of the duration


def simulate(
    conditions: Conditions,
    ice: str | Ground | Column | HalfSpace = "column",
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

    `ice` is `column`, `half-space`, the ground that columns lie on, or a model made for the
    conditions; `tolerance` the relative error of mu(t) aimed at; `integrator` one of `INTEGRATORS`
    or its name; `times` (s, ascending) where mu is sampled; `fixed_step` (s) replaces error
    control, `max_step` (s) bounds it; `observe` is called with every accepted step; `rubber` takes
    heat, too, if it is made of columns; with `loading` pressure and speed go in time, whatever the
    conditions say of them, and steps end on its corners; with `water` the viscosity follows the
    film's temperature, and that of the conditions is replaced. Raises SimulationStopped where a
    step cannot be made, ValueError where an argument is not possible.
    """
    for name, given, known in (("ice", ice, ICE_MODELS), ("integrator", integrator, INTEGRATORS)):
        if isinstance(given, str) and given not in known:
            raise ValueError(f'{name} = "{given}" is unknown; allowed: {", ".join(known)}')
    method = INTEGRATORS[integrator] if isinstance(integrator, str) else integrator
    if fixed_step is None and not method.estimate:
        raise ValueError("the integrator has no error estimate: give fixed_step")
    positive = {"tolerance": tolerance, "fixed_step": fixed_step, "max_step": max_step}
    for name, value in positive.items():
        if value is not None and not value > 0.0:
            raise ValueError(f"{name} = {value:g} is not possible; allowed: more than 0")
    n = conditions.pressure.size
    if water is not None:
        conditions = conditions._replace(viscosity=water(conditions.temperature))
    if loading is not None:
        conditions = loading.at(conditions, np.zeros(n))
    sample_times = np.asarray(times, dtype=float)
    if (np.diff(sample_times) < 0.0).any():
        raise ValueError("sample times must ascend")
    if isinstance(ice, str | Ground):
        ice = ice_below(ice, conditions.temperature, conditions.duration, conditions.solid)
        ice = ice.condensed(CONDENSED * tolerance)
    if isinstance(ice, HalfSpace) and not isinstance(rubber, Insulated):
        raise ValueError(
            "half-space ice and heat in the rubber contradict each other: the closed form gives "
            "the ice a flux that does not depend on the rubber; allowed with heat in the rubber: "
            "column"
        )
    heat, slack, dry = ice, EVENT_SHARE * tolerance, DRY
    if isinstance(ice, HalfSpace):
        slack, dry = JUMP * slack, dry / JUMP
        heat = ice.late(slack)
    state = InterfaceState(
        np.log(conditions.initial_height),
        np.zeros(n),
        heat.initial(n),
        rubber.initial(n),
        np.zeros((0 if water is None else 1, n)),
    )
    loads, pressure, duration = conditions.loads(water), conditions.pressure, conditions.duration
    here = conditions  # kept up only where there is a `loading`
    undercooling = conditions.melting_temperature - conditions.temperature
    scale = temperature_scale(SURFACE_EASE * undercooling, water)
    warmth = Warmth(conditions.temperature, undercooling)
    first = min(FIRST_STEP * tolerance, 0.01)
    dt = first * duration if fixed_step is None else np.full(n, fixed_step)
    # What goes round over a film's height in turn with another unknown wants it exactly.
    alone = fixed_step is None and water is None and isinstance(rubber, Insulated)
    close = close_enough(tolerance) if alone else CLOSE
    control = StepControl(method, tolerance if fixed_step is None else None, close, dry)

    def melting_now(state: InterfaceState, acting: FilmLoads) -> Array:
        on_ice = heat.surface_temperature(state.ice)
        heating = acting.viscous * acting.speed
        return warmth(rubber.film_temperature(on_ice, state.rubber, heating, state))

    # The conditions that still run, when, how warm they are, how far the next event is (s), and
    # d ln h / dt.
    active, time, warm = np.arange(n), np.zeros(n), melting_now(state, loads)
    ahead, rate = np.full(n, np.inf), np.zeros(n)
    if fixed_step is None:
        power = loads.viscous * loads.speed / conditions.initial_height
        # The error of the surface's temperature is about half its first rise, however short that.
        onset = onset_below(power, undercooling, conditions.solid)
        np.minimum(dt, (SURFACE_EASE * tolerance) ** 2 * onset, out=dt)
    cuts = np.zeros(n, dtype=int)  # in a row
    tally = Tally(conditions, sample_times)

    while active.size:
        dt_try = np.minimum(np.minimum(dt, ahead), duration - time)
        np.minimum(dt_try, max_step, out=dt_try)
        pressure_after, last = pressure, loads
        if loading is not None:
            dt_try = np.minimum(dt_try, loading.next_corner(time) - time)
            ends = loading.at(here, time + dt_try)
            pressure_after, last = ends.pressure, ends.loads(water)
        step, good, wanted = control.trial(state, loads, last, dt_try, heat, scale, rubber, rate)
        if loading is not None and fixed_step is None:
            bent = _bend(loads, loading.at(here, time + 0.5 * dt_try).loads(), last)
            good &= bent <= tolerance
            wanted = np.minimum(wanted, dt_try * step_factor(bent / tolerance, 2, GROW_ALONE))
        filled = state.squeezed_height / loads.free_height
        event = events(step, warm, filled, last, warmth, slack)
        across = event.across
        if fixed_step is None:
            # A step that was cut says nothing against a longer one. Across an event its error means
            # nothing; behind it the solution has a kink that an estimate can overlook unless the
            # steps grow from short ones again.
            np.maximum(wanted, dt, out=wanted, where=good & (dt_try < dt))
            begun = np.flatnonzero(event.melting | event.full)
            wanted[begun] = RESTART * dt[begun]
            wanted[across] = dt[across]
            dt = wanted
        good[across] = False
        bad = np.flatnonzero(~good)
        if fixed_step is None:
            stuck = bad[dt[bad] < SHORTEST_STEP * duration[bad]]
        else:
            stuck = np.setdiff1d(bad, across)
        _refuse(stuck, dt_try, pressure, loads, time)
        melting = event.melting | step.last.melting
        full = event.full | step.last.saturated
        acting = last, step, melting, full, pressure_after, heat
        record = Record(active, good, time, dt_try, *acting)
        mu = tally.add(record, state, loads.viscous / pressure, here, loading)
        if observe is not None and good.any():
            observe(record)
        warm_after, reached = melting_now(step.state, last), time + dt_try
        if fixed_step is None:
            expected = until(step, warm, warm_after, state.squeezed_height, last, slack)
        else:
            expected = np.full_like(ahead, np.inf)
        growth = step.change.log_height / step.stage_dt
        for new, old in ((expected, ahead), (warm_after, warm), (reached, time), (growth, rate)):
            new[bad] = old[bad]
        again = cuts[across] + 1
        cuts[:] = 0
        cuts[across] = again
        fraction = np.where(again > LINES, np.minimum(event.fraction, 0.5), event.fraction)
        expected[across] = fraction * dt_try[across]
        ahead, warm, time, rate = expected, warm_after, reached, growth
        state = taken(state, step.state, bad)
        if loading is not None:
            here = loading.at(here, time)
            pressure, loads = here.pressure, here.loads(water)
        running = time < duration * (1.0 - 1e-12)
        if not running.all():
            tally.finish(record, state, mu, running)
            keep = np.flatnonzero(running)
            active, time, dt, ahead, warm, rate, cuts, duration, pressure, scale = _at(
                keep, active, time, dt, ahead, warm, rate, cuts, duration, pressure, scale
            )
            loads, state, warmth = loads.take(keep), state.take(keep), warmth.take(keep)
            heat, rubber = heat.take(keep), rubber.take(keep)
            if loading is not None:
                here = here.take(keep)
    return tally.result


def ice_below(
    ice: str | Ground, temperature: float | Array, duration: float | Array, solid: Solid
) -> Column | HalfSpace:
    """The model of one of `ICE_MODELS`, or of columns on a ground, as `Column` is made."""
    if ice == "half-space":
        return HalfSpace(temperature, duration, solid)
    ground = ice if isinstance(ice, Ground) else BOTTOMLESS
    return Column(temperature, duration, solid=solid, ground=ground)


def taken(old: InterfaceState, new: InterfaceState, bad: Index) -> InterfaceState:
    """The `new` state, but at the points `bad` the `old` one; `new` is overwritten."""
    if bad.size:
        for before, after in zip(old, new, strict=True):
            after[..., bad] = before.take(bad, axis=-1, mode="clip")
    return new


def _at(index: Index, *parts: Any) -> Any:
    """The parts at `index`."""
    return (part.take(index, mode="clip") for part in parts)


def _refuse(stuck: Index, tried: Array, pressure: Array, loads: FilmLoads, time: Array) -> None:
    """Raise SimulationStopped if a step has failed that cannot be cut (any further)."""
    if stuck.size:
        i = stuck[0]
        raise SimulationStopped(
            f"the film at {pressure[i]:.4g} Pa and {loads.speed[i]:.4g} m/s cannot be advanced "
            f"beyond t = {time[i]:.4g} s: a step of {tried[i]:.2g} s is too long for this "
            "integrator; take a shorter one, or an implicit integrator"
        )


def _bend(start: FilmLoads, middle: FilmLoads, end: FilmLoads) -> Array:
    """How far loads in the middle of a step are from the line between its ends, relative."""
    line = interpolate(start, end, 0.5)
    gaps = (
        np.abs(getattr(middle, name) - getattr(line, name))
        / np.maximum(np.abs(getattr(end, name)), np.abs(getattr(start, name)) + 1e-300)
        for name in ("viscous", "squeeze_rate")
    )
    return np.maximum(*gaps)
