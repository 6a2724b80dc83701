"""The point level: the film law and the ice below it at one pressure, for many conditions at once.

Each condition has its own time and step. Steps end on melt onset and on saturation, so the
integrator keeps its order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.driving import Drive, Driven, history_after
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.point_events import Warmth, events, onset_below
from iceslide_fem.film.point_result import PointResult, Record, Tally
from iceslide_fem.film.point_steps import SURFACE_EASE, AsGiven, ByError, Front, StepLengths
from iceslide_fem.film.rubber_heat import INSULATED, Insulated, RubberHeat
from iceslide_fem.film.runge_kutta import INTEGRATORS, Integrator
from iceslide_fem.film.step_control import DRY, StepControl, close_enough
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.materials import BOTTOMLESS, Ground, Solid

ICE_MODELS = ("column", "half-space")
# Accuracy of a step's end at an event, relative to the tolerance.
EVENT_SHARE = 0.005
# The same for half-space ice. Its flux jumps at the onset, and mu changes within a hundredth of the
# onset time. Errors of the onset time, and of the dry film before it, have a larger weight.
JUMP = 0.2
# Error of the ice response with fewer modes, relative to the tolerance.
CONDENSED = 0.005
YOUNGEST = 1e-8  # age of contact at t = 0, of the duration


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
    water: Curve | None = None,
    start: InterfaceState | None = None,
) -> PointResult:
    """Integrate all `conditions` from t = 0 to their duration.

    ice: `column`, `half-space`, the ground below columns, or a model built for the conditions;
    tolerance: target relative error of mu(t); integrator: one of `INTEGRATORS` or its name; times:
    where mu is sampled (s, ascending); fixed_step: replaces error control, s; max_step: largest
    step, s; observe: called with every accepted step; rubber: insulated, or columns that take heat;
    loading: pressure and speed over time, which replace those of the conditions (steps end on its
    kinks); water: table of a temperature-dependent viscosity, which replaces that of the
    conditions; start: initial films and ice, by default films of the initial height on cold ice.
    Raises SimulationStopped if a step fails, ValueError for an invalid argument.
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
    conditions = conditions.in_water(water)
    duration = conditions.duration
    if isinstance(ice, str | Ground):
        ice = ice_below(ice, conditions.temperature, duration, conditions.solid)
        ice = ice.condensed(CONDENSED * tolerance)
    if start is None:
        n = conditions.pressure.size
        untouched = np.zeros((0, n)) if loading is None else loading.untouched(n)
        speed = conditions.speed
        if loading is not None and loading.speed is not None:
            speed = loading.speed(np.zeros(n))
        here = conditions._replace(speed=speed)
        films = here.films(conditions.initial_height, conditions.temperature, water)
        heats = ice.initial(n), rubber.initial(n)
        start = InterfaceState(films.log_height, np.zeros(n), *heats, films.internal, untouched)
    span = Span(duration, conditions.temperature, conditions.melting_temperature, conditions.solid)
    drive = Driven(conditions, loading, water)
    steps = Steps(tolerance, method, fixed_step, max_step)
    return integrate(drive, start, span, ice, rubber, steps, times, observe, water)


class Span(NamedTuple):
    """The run of points: duration (s), and temperature (K), T_m (K) and solid of their ice."""

    duration: Array
    temperature: Array
    melting_temperature: Array | float
    solid: Solid

    @property
    def undercooling(self) -> Array:
        """T_m - T_0, K."""
        return np.asarray(self.melting_temperature - self.temperature)


class Steps(NamedTuple):
    """Steps of points: target relative error of mu(t), method, fixed length or None, longest (s).

    A fixed step replaces error control.
    """

    tolerance: float
    method: Integrator
    fixed: float | None = None
    longest: float = np.inf


def integrate(
    drive: Drive,
    begin: InterfaceState,
    span: Span,
    ice: Column | HalfSpace,
    rubber: RubberHeat,
    steps: Steps,
    times: ArrayLike = (),
    observe: Callable[[Record], None] | None = None,
    water: Curve | None = None,
) -> PointResult:
    """Integrate points that a `drive` acts on, from the state `begin` at t = 0.

    The others are arguments of `simulate`. Raises SimulationStopped if a step fails, ValueError for
    an invalid argument.
    """
    n, tolerance, duration = span.duration.size, steps.tolerance, span.duration
    sample_times = np.asarray(times, dtype=float)
    if (np.diff(sample_times) < 0.0).any():
        raise ValueError("sample times must ascend")
    if isinstance(ice, HalfSpace) and not isinstance(rubber, Insulated):
        raise ValueError(
            "half-space ice and heat in the rubber contradict each other: the closed form gives "
            "the ice a flux that does not depend on the rubber; allowed with heat in the rubber: "
            "column"
        )
    heat, band, dry = ice, EVENT_SHARE * tolerance, DRY
    if isinstance(ice, HalfSpace):
        band, dry = JUMP * band, dry / JUMP
        heat = ice.late(band)
    youngest = YOUNGEST * duration
    begin = begin._replace(age=history_after(drive, begin, np.zeros(n), youngest, heat, rubber))
    loads = drive.loads(np.zeros(n), begin.age)
    # Iterations over film height and another unknown need an exact height.
    alone = steps.fixed is None and loads.alone and isinstance(rubber, Insulated)
    close = close_enough(tolerance) if alone else CLOSE
    control = StepControl(steps.method, tolerance if steps.fixed is None else None, close, dry)
    lengths: StepLengths = ByError(tolerance)
    if steps.fixed is not None:
        lengths = AsGiven(steps.fixed)
    first_shear = loads.shear(begin, heat)
    onset = onset_below(first_shear * loads.speed, span.undercooling, span.solid)
    front = Front(
        active=np.arange(n),
        time=np.zeros(n),
        duration=duration,
        dt=lengths.first(duration, onset),
        cuts=np.zeros(n, dtype=int),
        ahead=np.full(n, np.inf),
        warm=np.zeros(n),
        rate=np.zeros(n),
        scale=temperature_scale(SURFACE_EASE * span.undercooling, water),
        warmth=Warmth(span.temperature, span.undercooling),
        drive=drive,
        loads=loads,
        state=begin,
        ice=heat,
        rubber=rubber,
    )
    front = front._replace(warm=front.melting_at(front.state, loads))
    pressure = drive.pressure(np.zeros(n))
    result = PointResult.at_start(first_shear / pressure, begin, loads, sample_times)
    tally = Tally(result, duration, sample_times)

    while front.active.size:
        dt, drive, last = front.length(steps.longest), front.drive, front.loads
        state, models = front.state, (front.ice, front.scale, front.rubber)
        ends, age = front.time + dt, state.age
        if not drive.constant:
            age = history_after(drive, state, front.time, dt, front.ice, front.rubber)
            last = drive.loads(ends, age)
        trial = control.trial(state, front.loads, last, dt, *models, front.rate)
        drive.check(front.time)
        step, filled = trial.step, state.squeezed_height / front.loads.free_height
        event = events(step, front.warm, filled, last, front.warmth, band)
        good, following = lengths.judge(front, trial, event, dt, last)
        good = drive.agreed(good)
        bad = np.flatnonzero(~good)
        _refuse(lengths.stuck(bad, event, front, following), dt, front)
        melting = event.melting | step.last.melting
        full = event.full | step.last.saturated
        after = step.state if age is step.state.age else step.state._replace(age=age)
        acting = last, step, melting, full, drive.pressure(ends), front.ice, after
        record = Record(front.active, good, front.time, dt, *acting)
        mu = tally.add(record, state, front.loads, drive.pressure(front.time))
        if observe is not None and good.any():
            observe(record)
        warm, time = front.melting_at(step.state, last), ends
        warm[step.last.melting] = 1.0  # also where films and columns differ by their errors
        ahead = lengths.ahead(front, step, warm, last, band)
        rate = step.change.log_height / step.stage_dt
        for new, old in (
            (ahead, front.ahead),
            (warm, front.warm),
            (time, front.time),
            (rate, front.rate),
        ):
            new[bad] = old[bad]
        ahead, cuts = front.cut(ahead, event, dt)
        state = taken(state, after, bad)
        front = front._replace(
            time=time, dt=following, cuts=cuts, ahead=ahead, warm=warm, rate=rate, state=state
        )
        if not drive.constant:
            front = front._replace(loads=last if not bad.size else drive.loads(time, state.age))
        running = time < front.duration * (1.0 - 1e-12)
        if not running.all():
            tally.finish(record, state, mu, running)
            front = front.take(np.flatnonzero(running))
    return tally.result


def ice_below(
    ice: str | Ground, temperature: float | Array, duration: float | Array, solid: Solid
) -> Column | HalfSpace:
    """The ice of one of `ICE_MODELS`, or columns on a ground; arguments as for `Column`."""
    if ice == "half-space":
        return HalfSpace(temperature, duration, solid)
    ground = ice if isinstance(ice, Ground) else BOTTOMLESS
    return Column(temperature, duration, solid=solid, ground=ground)


def taken(old: InterfaceState, new: InterfaceState, bad: Index) -> InterfaceState:
    """The `new` state with the `old` one at the points `bad`; overwrites `new`."""
    if bad.size:
        for before, after in zip(old, new, strict=True):
            after[..., bad] = before.take(bad, axis=-1, mode="clip")
    return new


def _refuse(stuck: Index, dt: Array, front: Front) -> None:
    """Raise SimulationStopped if a step of `dt` (s) fails that cannot be shortened."""
    if stuck.size:
        i, subject = stuck[0], front.drive.subject(stuck[0], front.time)
        raise SimulationStopped(
            f"{subject} cannot be advanced beyond t = {front.time[i]:.4g} s: a step of "
            f"{dt[i]:.2g} s is too long for this integrator; {front.drive.advice}"
        )
