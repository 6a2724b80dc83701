"""Friction of the point level for many scenes, each under many loads, in few calls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.conditions import (
    exposures,
    rubber_columns,
    simulation_settings,
    varied_conditions,
)
from iceslide_fem.film.hysteresis import hysteresis_of
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.point import simulate
from iceslide_fem.film.point_conditions import Conditions
from iceslide_fem.film.point_result import Record
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.shear_strength import shear_strength
from iceslide_fem.film.strength_over_speed import speed_law
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene
from iceslide_fem.scene.materials import BOTTOMLESS
from iceslide_fem.scene.variation import with_values

CHUNK = 20_000  # points of a call: more only take memory
KEYS = {
    "pressure": "load.pressure",
    "speed": "load.speed",
    "temperature": "ice.temperature",
    "duration": "load.duration",
}
OUTPUTS = ("mu_mean", "mu_peak", "mu_end")


class Rows(NamedTuple):
    """Loads of n rows, (n,) each: pressure (Pa), speed (m/s), temperature of the ice (K), duration
    (s); None: those of each scene.
    """

    pressure: Array | None = None
    speed: Array | None = None
    temperature: Array | None = None
    duration: Array | None = None

    @property
    def given(self) -> dict[str, Array]:
        """The given ones by name."""
        return {name: part for name, part in self._asdict().items() if part is not None}

    def of(self, scene: Scene) -> dict[str, Array]:
        """All four of a `scene`, (n,) each."""
        load = scene.load
        own = {
            "pressure": load.pressures.first,
            "speed": load.speeds.first,
            "temperature": scene.ice.temperature,
            "duration": load.duration,
        }
        parts = np.broadcast_arrays(*(np.atleast_1d(v) for v in (own | self.given).values()))
        return dict(zip(own, (np.array(part, dtype=float) for part in parts), strict=True))

    @property
    def number(self) -> int:
        """n."""
        return max((part.size for part in self.given.values()), default=1)


class Friction(NamedTuple):
    """mu of m scenes under n rows, (m, n): its mean over the duration, largest value, and end.

    samples: mu at times (m, n, times); failures: why by scene and row, whose mu is NaN.
    """

    mu_mean: Array
    mu_peak: Array
    mu_end: Array
    samples: Array
    failures: dict[tuple[int, int], str]


def friction(scenes: Sequence[Scene], rows: Rows = Rows(), times: ArrayLike = ()) -> Friction:  # noqa: B008
    """Friction of point `scenes`, each under all `rows`; mu also at `times` (s, ascending).

    It is that of their runs: on sliding ice that of the block, with passes over all of them. Scenes
    with constant loads under the film law share calls, others run one by one.
    """
    at = np.asarray(times, dtype=float)
    shape = len(scenes), rows.number
    mean, peak, end = np.full((len(OUTPUTS), *shape), np.nan)
    found = Friction(mean, peak, end, np.full((*shape, at.size), np.nan), {})
    groups: dict[Any, list[int]] = {}
    for number, scene in enumerate(scenes):
        groups.setdefault(shared_by(scene), []).append(number)
    for key, numbers in groups.items():
        if key is None:
            for number in numbers:
                _alone(found, number, scenes[number], rows, at)
            continue
        each = max(1, CHUNK // rows.number)
        for first in range(0, len(numbers), each):
            _fill(found, numbers[first : first + each], scenes, rows, at)
    return found


def shared_by(scene: Scene) -> tuple[Any, ...] | None:
    """What scenes must have in common to share a call; None of a scene that runs alone.

    Alone: passes (each starts from the last one); loads over time, user laws, voids that carry and
    fixed steps (each has its steps); contact that ages under a block (ice meets rubber of all
    ages).
    """
    if (
        scene.several_passes
        or not INTEGRATORS[scene.numerics.film_integrator].estimate
        or scene.load.changes
        or scene.friction.law != "film"
        or (scene.film.contact_age and scene.ice.motion == "sliding")
        or scene.film.voids == "carry"
    ):
        return None
    ice, rubber, strength = scene.ice, scene.rubber, shear_strength(scene)
    heat: tuple[Any, ...] = ()
    if rubber.heat:  # its columns start at one temperature
        film = scene.film.conductance, scene.water.conductivity
        heat = scene.rubber_temperature, ice.melting_temperature, *rubber.solid, *film
    below = None if ice.ground == BOTTOMLESS else ice.solid  # one solid for all on it
    rows = 0 if strength is None else len(strength.depth)
    settings = simulation_settings(scene)
    law = hysteresis_of(scene)
    rough = law if settings["loading"] is not None else law is not None
    components = rows, scene.refreeze, rough, speed_law(scene)
    return ice.motion, heat, below, *components, *settings.values()


def _fill(
    found: Friction, numbers: list[int], scenes: Sequence[Scene], rows: Rows, times: Array
) -> None:
    """Put in the friction of scenes that share a call; if it fails, of halves of them."""
    try:
        _together(found, numbers, scenes, rows, times)
    except SimulationStopped as reason:
        if len(numbers) > 1:
            half = len(numbers) // 2
            for part in (numbers[:half], numbers[half:]):
                _fill(found, part, scenes, rows, times)
        elif rows.number > 1:
            _alone(found, numbers[0], scenes[numbers[0]], rows, times)
        else:
            found.failures[numbers[0], 0] = str(reason)


def _together(
    found: Friction, numbers: list[int], scenes: Sequence[Scene], rows: Rows, times: Array
) -> None:
    """Put in the friction of scenes that share a call. Raises SimulationStopped."""
    parts, transits, lasts = [], [], []
    for number in numbers:
        scene = scenes[number]
        loads = rows.of(scene)
        duration = loads.pop("duration")
        parts.append(
            varied_conditions(scene, duration=exposures(scene, loads["speed"], duration), **loads)
        )
        transits.append(scene.rubber.length / loads["speed"])
        lasts.append(duration)
    first = scenes[numbers[0]]
    conditions = Conditions.together(parts)
    settings = simulation_settings(first)
    rubber = rubber_columns(first, np.unique(conditions.duration))
    sliding = None
    if first.ice.motion == "sliding":
        sliding = _Block(conditions, settings["water"], np.concatenate(transits), times)
    observe = None if sliding is None else sliding.add
    run = simulate(conditions, times=times, rubber=rubber, observe=observe, **settings)
    mean, peak, end, samples = run.mu_mean, run.mu_peak, run.mu_end, run.samples.T
    if sliding is not None:
        mean, peak, end, samples = sliding.finished(np.concatenate(lasts))
    shape = len(numbers), rows.number
    for whole, part in zip(found[:3], (mean, peak, end), strict=True):
        whole[numbers] = part.reshape(shape)
    found.samples[numbers] = samples.reshape(*shape, times.size)


class _Block:
    """Friction of blocks on sliding ice, from that of one point of the ice each.

    By transit-time equivalence (docs/explanation/passing.md), with T = L / v: the block's mu(t) is
    (integral of mu from 0 to t + (T - t) mu(t)) / T up to T, and then constant.
    """

    def __init__(
        self, conditions: Conditions, water: Curve | None, transit: Array, times: Array
    ) -> None:
        """For blocks whose ice is below them for `transit` (s); mu also at `times` (s)."""
        self._power, self._transit = conditions.pressure * conditions.speed, transit
        self._times = times
        here = conditions.in_water(water)
        nothing = np.zeros_like(transit)
        films = here.films(here.initial_height, here.temperature, water)
        untouched = np.zeros((0, transit.size))
        state = InterfaceState(
            films.log_height, nothing, untouched, untouched, films.internal, untouched
        )
        mu = here.loads(water).stress_of(np.exp(log_shearing(state)), state) / here.pressure
        self._mu, self._time = mu.copy(), np.zeros_like(mu)
        self._slid, self._twice = np.zeros_like(mu), np.zeros_like(mu)
        self.peak = mu.copy()
        self._samples = np.repeat(mu[:, None], times.size, axis=1)

    def add(self, record: Record) -> None:
        """Add accepted steps: the integral of mu, and that of the integral."""
        at, points = record.places, record.points
        dt = record.dt[at]
        before = self._slid[points]
        after = before + record.step.friction_work[at] / self._power[points]
        first, transit = self._time[points], self._transit[points]
        end = first + dt
        mu = (record.loads.stress(record.step.last) / record.pressure)[at]
        self._twice[points] += 0.5 * (before + after) * dt
        old = before + np.maximum(transit - first, 0.0) * self._mu[points]
        new = after + np.maximum(transit - end, 0.0) * mu
        self.peak[points] = np.maximum(self.peak[points], new / transit)
        if self._times.size:
            part = (self._times - first[:, None]) / dt[:, None]
            value = (old[:, None] + np.minimum(part, 1.0) * (new - old)[:, None]) / transit[:, None]
            self._samples[points] = np.where(part > 0.0, value, self._samples[points])
        self._slid[points], self._mu[points], self._time[points] = after, mu, end

    def finished(self, duration: Array) -> tuple[Array, Array, Array, Array]:
        """Mean over the `duration` (s), peak, end, and samples (n, times) of mu."""
        rest = np.maximum(self._transit - self._time, 0.0)
        end = (self._slid + rest * self._mu) / self._transit
        work = (2.0 * self._twice + rest * self._slid) / self._transit
        work += np.maximum(duration - self._time, 0.0) * self._slid / self._transit
        return work / duration, self.peak, end, self._samples


def _alone(found: Friction, number: int, scene: Scene, rows: Rows, times: Array) -> None:
    """Put in the friction of one scene, row by row."""
    for row, changed in enumerate(_row_scenes(scene, rows)):
        try:
            history, entries = point_history(changed)
        except SimulationStopped as reason:
            found.failures[number, row] = str(reason)
            continue
        for whole, name in zip(found[:3], OUTPUTS, strict=True):
            whole[number, row] = entries[name]
        if times.size:
            own, mu = zip(*((one.time_s, one.mu) for one in history), strict=True)
            found.samples[number, row] = np.interp(times, own, mu)


def _row_scenes(scene: Scene, rows: Rows) -> Iterator[Scene]:
    """The scene under each row, whose loads are as given, without the scene's factors."""
    given = rows.given
    whole = {f"load.{name}_scale": 1.0 for name in ("pressure", "speed") if name in given}
    for row in range(rows.number):
        changes = {KEYS[name]: float(np.broadcast_to(part, rows.number)[row])
                   for name, part in given.items()}  # fmt: skip
        yield with_values(scene, whole | changes)
