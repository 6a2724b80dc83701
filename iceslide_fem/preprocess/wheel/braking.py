"""A quarter car that brakes on ice from one speed to another, with friction from a table.

m dv/dt = -mu(v, S) N, I domega/dt = r mu(v, S) N - T, dx/dt = v, with the slip ratio
S = 1 - r omega / v (H. B. Pacejka, *Tire and Vehicle Dynamics*, chapter 8). A wheel with omega = 0
is locked, S = 1, and stays locked while T exceeds r mu N.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.preprocess.wheel.quarter_car import Brake, QuarterCar, Threshold
from iceslide_fem.preprocess.wheel.slip_table import KMH, SlipTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError, SimulationStopped


class History(NamedTuple):
    """A stop over time, (n,) each, in s, m/s, rad/s, 1, 1, N m and m."""

    time: Array
    speed: Array
    wheel_speed: Array
    slip: Array
    mu: Array
    torque: Array
    distance: Array


@dataclass(frozen=True)
class Stop:
    """A stop from the first to the last speed of its `history`.

    contact_work, brake_work: heat of the contact (mu N S v over time) and of the brake (T omega),
    J; kinetic_energy: loss of car and wheel, J, the sum of both.
    """

    history: History
    contact_work: float
    brake_work: float
    kinetic_energy: float

    @property
    def time(self) -> float:
        """Duration of the stop, s."""
        return float(self.history.time[-1])

    @property
    def distance(self) -> float:
        """Distance of the stop, m."""
        return float(self.history.distance[-1])

    @property
    def deceleration(self) -> float:
        """Mean deceleration over the distance x, (v0^2 - v1^2) / (2 x), m/s2."""
        first, last = self.history.speed[[0, -1]]
        return float((first**2 - last**2) / (2.0 * self.distance))

    def between(self, first: float, last: float) -> float:
        """Mean deceleration from one speed to another (m/s), (v1^2 - v2^2) / (2 x), m/s2."""
        squares = self.history.speed**2
        way = np.interp([last**2, first**2], squares[::-1], self.history.distance[::-1])
        return float((first**2 - last**2) / (2.0 * (way[0] - way[1])))

    @property
    def cycle(self) -> float:
        """Speed (m/s) lost in a cycle of the control: the middle of all whole ones, 0 without."""
        torque = self.history.torque
        rises = np.diff(torque) > 0.0
        tops = np.flatnonzero(rises[:-1] & ~rises[1:]) + 1
        lost = -np.diff(self.history.speed[tops])
        return float(np.median(lost)) if lost.size else 0.0

    def __str__(self) -> str:
        """One line with speeds, distance, time and deceleration."""
        first, last = KMH * self.history.speed[[0, -1]]
        return (
            f"from {first:.4g} km/h to {last:.4g} km/h in {self.distance:.4g} m, "
            f"{self.time:.4g} s, at {self.deceleration:.3g} m/s2"
        )


CONTROLS = ("locked", "threshold", "ideal")
WEAKEST, PATIENCE = 0.05, 10.0  # m/s2, s: least mean deceleration of a stop after that time
PICTURED = 0.05  # s, largest time between two rows of a history
V, OMEGA, X, TORQUE, CONTACT, BRAKE = range(6)  # indices of the state; the last two are works, J


def brake(
    table: SlipTable,
    speed: float,
    end_speed: float,
    car: QuarterCar,
    brakes: Brake,
    threshold: Threshold | None = None,
    tolerance: float = 1e-7,
) -> Stop:
    """Brake from `speed` to `end_speed` (m/s), with constant torque or `threshold` control.

    tolerance: relative error of a step. Raises SceneError if the table does not contain both speeds
    or their order is wrong, SimulationStopped if the car decelerates by less than `WEAKEST`.
    """
    from scipy.integrate import solve_ivp

    _check_speeds(table, speed, end_speed)
    energy = _kinetic_energy(car, speed, speed / car.radius)
    scale = np.array([speed, speed / car.radius, speed**2, brakes.largest_torque, energy, energy])
    time, state = 0.0, np.array([speed, speed / car.radius, 0.0, 0.0, 0.0, 0.0])
    rise, releases, locked = brakes.rise, False, False
    times, states = [np.zeros(1)], [state[:, None]]
    while True:
        rate = _rate(state[TORQUE], rise, releases, brakes, threshold)
        wheel = _Wheel(table, car, rate, locked)
        events = wheel.events(end_speed, brakes, releases, threshold)
        events["weak"] = _event(lambda t, y: y[V] - speed + WEAKEST * (t - PATIENCE), 1.0)
        # Implicit: the slip of a slow wheel follows its torque in less than a millisecond.
        found = solve_ivp(
            wheel, (time, PATIENCE + speed / WEAKEST), state, method="Radau", rtol=tolerance,
            atol=tolerance * scale, max_step=PICTURED, events=list(events.values()),
        )  # fmt: skip
        happened = [name for name, at in zip(events, found.t_events, strict=True) if at.size]
        if not happened or happened[0] == "weak":
            raise SimulationStopped(
                f"the car still has {KMH * found.y[V, -1]:.3g} km/h after {found.t[-1]:.0f} s, "
                f"less than {WEAKEST:g} m/s2: the brake or the friction is too weak"
            )
        time, state = found.t[-1], found.y[:, -1].copy()
        match happened[0]:
            case "locks":
                locked, state[OMEGA] = True, 0.0
            case "turns":
                locked = False
            case "full":
                state[TORQUE] = brakes.largest_torque
            case "empty":
                state[TORQUE] = 0.0
            case "high":
                releases = True
            case "low":
                assert threshold is not None
                releases, rise = False, threshold.build
        times.append(found.t[1:])
        states.append(np.column_stack([found.y[:, 1:-1], state]))
        if happened[0] == "end":
            return _stop(table, car, np.concatenate(times), np.concatenate(states, axis=1))


def brake_ideally(
    table: SlipTable, speed: float, end_speed: float, car: QuarterCar, tolerance: float = 1e-7
) -> Stop:
    """Brake with the largest mu of the table at every speed: the shortest possible stop.

    The slip is always that of the peak: the wheel has no inertia, and the torque is r mu N. Raises
    as `brake`.
    """
    from scipy.integrate import solve_ivp

    _check_speeds(table, speed, end_speed)

    def motion(_: float, state: Array) -> tuple[float, ...]:
        slip, mu = table.peak(state[0])
        force = mu * car.wheel_load
        power = force * state[0]
        return -force / car.mass, state[0], slip * power, (1.0 - slip) * power

    def slow(_: float, state: Array) -> float:
        return float(state[0] - end_speed)

    energy = _kinetic_energy(car, speed, 0.0)
    scale = tolerance * np.array([speed, speed**2, energy, energy])
    found = solve_ivp(
        motion, (0.0, speed / WEAKEST), [speed, 0.0, 0.0, 0.0], rtol=tolerance, atol=scale,
        max_step=PICTURED, events=_event(slow, -1.0),
    )  # fmt: skip
    if not found.t_events[0].size:
        raise SimulationStopped(f"the friction is too weak to brake within {speed / WEAKEST:.0f} s")
    v, x, contact, braked = found.y
    slip, mu = np.array([table.peak(each) for each in v]).T
    torque = mu * car.wheel_load * car.radius
    history = History(found.t, v, (1.0 - slip) * v / car.radius, slip, mu, torque, x)
    lost = energy - _kinetic_energy(car, v[-1], 0.0)
    return Stop(history, float(contact[-1]), float(braked[-1]), lost)


def compare_controls(
    table: SlipTable,
    speed: float,
    end_speed: float,
    car: QuarterCar | None = None,
    brakes: Brake | None = None,
    threshold: Threshold | None = None,
    tolerance: float = 1e-7,
) -> dict[str, Stop]:
    """The same stop with "locked" wheel (constant torque), "threshold" control, and "ideal".

    A too weak brake does not lock the wheel. Tolerance and what is raised are as of `brake`.
    """
    car, brakes, threshold = car or QuarterCar(), brakes or Brake(), threshold or Threshold()
    rest = table, speed, end_speed, car, brakes, threshold, tolerance
    return {control: brake_by(control, *rest) for control in CONTROLS}


def brake_by(
    control: str,
    table: SlipTable,
    speed: float,
    end_speed: float,
    car: QuarterCar,
    brakes: Brake,
    threshold: Threshold,
    tolerance: float,
) -> Stop:
    """The stop by one of `CONTROLS`. Arguments and what is raised are as of `brake`."""
    if control == "ideal":
        return brake_ideally(table, speed, end_speed, car, tolerance)
    held = threshold if control == "threshold" else None
    return brake(table, speed, end_speed, car, brakes, held, tolerance)


def starts(first: Stop, count: int, highest: float) -> Array:
    """Speeds (m/s) at which stops begin that are like the `first`, in `count` phases of its cycle.

    They are above its own, by parts of the speed that a cycle loses, and at most `highest`.
    """
    speed = float(first.history.speed[0])
    room = min(first.cycle, highest - speed)
    return np.asarray(speed + room * np.arange(count) / count)


class _Wheel(NamedTuple):
    """The motion while the torque changes at a constant `rate` (N m/s), rolling or locked."""

    table: SlipTable
    car: QuarterCar
    rate: float
    locked: bool

    def slip(self, state: Array) -> float:
        return 1.0 if self.locked else float(1.0 - self.car.radius * state[OMEGA] / state[V])

    def force(self, state: Array) -> float:
        return self.table.inside(state[V], self.slip(state)) * self.car.wheel_load

    def __call__(self, _: float, state: Array) -> tuple[float, ...]:
        force, radius, torque = self.force(state), self.car.radius, state[TORQUE]
        spin = 0.0 if self.locked else (radius * force - torque) / self.car.inertia
        contact = force * (state[V] - radius * state[OMEGA])
        return -force / self.car.mass, spin, state[V], self.rate, contact, torque * state[OMEGA]

    def events(
        self, end_speed: float, brakes: Brake, releases: bool, threshold: Threshold | None
    ) -> dict[str, Callable[..., float]]:
        """Events that end this motion, by name."""
        found = {"end": _event(lambda _, y: y[V] - end_speed, -1.0)}
        if self.locked:
            held = self.car.radius
            found["turns"] = _event(lambda _, y: y[TORQUE] - held * self.force(y), -1.0)
        else:
            found["locks"] = _event(lambda _, y: y[OMEGA], -1.0)
        if self.rate > 0.0:
            found["full"] = _event(lambda _, y: y[TORQUE] - brakes.largest_torque, 1.0)
        if self.rate < 0.0:
            found["empty"] = _event(lambda _, y: y[TORQUE], -1.0)
        if threshold is not None and releases:
            found["low"] = _event(lambda _, y: self.slip(y) - threshold.low, -1.0)
        if threshold is not None and not releases:
            found["high"] = _event(lambda _, y: self.slip(y) - threshold.high, 1.0)
        return found


def _event(function: Callable[..., Any], direction: float) -> Callable[..., float]:
    """`function` as a SciPy event that ends the integration at its zero crossing."""
    setattr(function, "terminal", True)  # noqa: B010
    setattr(function, "direction", direction)  # noqa: B010
    return function


def _rate(
    torque: float, rise: float, releases: bool, brakes: Brake, threshold: Threshold | None
) -> float:
    """dT/dt, N m/s; 0 at both ends of the torque's range."""
    if releases:
        assert threshold is not None
        return -threshold.release if torque > 0.0 else 0.0
    return rise if torque < brakes.largest_torque else 0.0


def _stop(table: SlipTable, car: QuarterCar, time: Array, states: Array) -> Stop:
    """The stop from states (6, n) at times (n,)."""
    v, omega, x, torque, contact, braked = states
    slip = np.clip(1.0 - car.radius * omega / v, 0.0, 1.0)
    mu = np.array([table.inside(*each) for each in zip(v, slip, strict=True)])
    lost = _kinetic_energy(car, v[0], omega[0]) - _kinetic_energy(car, v[-1], omega[-1])
    history = History(time, v, omega, slip, mu, torque, x)
    return Stop(history, float(contact[-1]), float(braked[-1]), lost)


def _kinetic_energy(car: QuarterCar, speed: float, wheel_speed: float) -> float:
    return float(0.5 * (car.mass * speed**2 + car.inertia * wheel_speed**2))


def _check_speeds(table: SlipTable, speed: float, end_speed: float) -> None:
    table.check_speed(speed)
    table.check_speed(end_speed)
    if not end_speed < speed:
        raise SceneError(
            f"braking from {KMH * speed:.4g} km/h to {KMH * end_speed:.4g} km/h is no braking: the "
            "second speed must be below the first"
        )
