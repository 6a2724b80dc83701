"""The point level: the film law and the ice below it at one pressure, for many conditions at once.

Each condition has its own time and step. Steps end on melt onset and on saturation, so the
integrator keeps its order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.point_conditions import Conditions, InTime
from iceslide_fem.film.point_events import Warmth, events
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
    loading: InTime | None = None,
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
    if water is not None and conditions.limit is not None:
        raise ValueError("a viscosity over temperature and a limiting shear contradict each other")
    if water is not None:
        conditions = conditions._replace(viscosity=water(conditions.temperature))
    n, duration = conditions.pressure.size, conditions.duration
    if loading is not None:
        conditions = loading.at(conditions, np.zeros(n))
    sample_times = np.asarray(times, dtype=float)
    if (np.diff(sample_times) < 0.0).any():
        raise ValueError("sample times must ascend")
    if isinstance(ice, str | Ground):
        ice = ice_below(ice, conditions.temperature, duration, conditions.solid)
        ice = ice.condensed(CONDENSED * tolerance)
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
    # Iterations over film height and another unknown need an exact height.
    alone = fixed_step is None and water is None and isinstance(rubber, Insulated)
    close = close_enough(tolerance) if alone else CLOSE
    control = StepControl(method, tolerance if fixed_step is None else None, close, dry)
    lengths: StepLengths = ByError(tolerance, loading)
    if fixed_step is not None:
        lengths = AsGiven(fixed_step)

    loads = conditions.loads(water)
    films = conditions.films(conditions.initial_height, conditions.temperature, water)
    begin = start or InterfaceState(
        films.log_height,
        np.zeros(n),
        heat.initial(n),
        rubber.initial(n),
        films.internal,
    )
    first_shear = conditions.first_shear if start is None else loads.shear(start, heat)
    undercooling = conditions.melting_temperature - conditions.temperature
    front = Front(
        active=np.arange(n),
        time=np.zeros(n),
        duration=duration,
        dt=lengths.first(conditions, loads),
        cuts=np.zeros(n, dtype=int),
        ahead=np.full(n, np.inf),
        warm=np.zeros(n),
        rate=np.zeros(n),
        scale=temperature_scale(SURFACE_EASE * undercooling, water),
        warmth=Warmth(conditions.temperature, undercooling),
        here=conditions,
        loads=loads,
        state=begin,
        ice=heat,
        rubber=rubber,
    )
    front = front._replace(warm=front.melting_at(front.state, loads))
    result = PointResult.at_start(first_shear / conditions.pressure, begin, loads, sample_times)
    tally = Tally(result, duration, sample_times)

    while front.active.size:
        dt = front.length(max_step, loading)
        here, last = front.here, front.loads
        if loading is not None:
            here = loading.at(here, front.time + dt)
            last = here.loads(water)
        state, models = front.state, (front.ice, front.scale, front.rubber)
        trial = control.trial(state, front.loads, last, dt, *models, front.rate)
        step, filled = trial.step, state.squeezed_height / front.loads.free_height
        event = events(step, front.warm, filled, last, front.warmth, band)
        good, following = lengths.judge(front, trial, event, dt, last)
        bad = np.flatnonzero(~good)
        _refuse(lengths.stuck(bad, event, front, following), dt, front)
        melting = event.melting | step.last.melting
        full = event.full | step.last.saturated
        acting = last, step, melting, full, here.pressure, front.ice
        record = Record(front.active, good, front.time, dt, *acting)
        factor = front.loads.viscous / front.here.pressure
        mu = tally.add(record, state, factor, front.here, loading)
        if observe is not None and good.any():
            observe(record)
        warm, time = front.melting_at(step.state, last), front.time + dt
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
        state = taken(state, step.state, bad)
        front = front._replace(
            time=time, dt=following, cuts=cuts, ahead=ahead, warm=warm, rate=rate, state=state
        )
        if loading is not None:
            here = loading.at(front.here, time)
            front = front._replace(here=here, loads=here.loads(water))
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
        i, pressure, speed = stuck[0], front.here.pressure, front.loads.speed
        raise SimulationStopped(
            f"the film at {pressure[i]:.4g} Pa and {speed[i]:.4g} m/s cannot be advanced beyond "
            f"t = {front.time[i]:.4g} s: a step of {dt[i]:.2g} s is too long for this "
            "integrator; take a shorter one, or an implicit integrator"
        )
