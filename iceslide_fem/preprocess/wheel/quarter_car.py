"""Parameters of a stop: a quarter car, its brake and its control."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite

from iceslide_fem.runtime.errors import SceneError

GRAVITY = 9.80665  # m/s2, standard


def _check_positive(given: QuarterCar | Brake | Threshold, what: str) -> None:
    """Raise SceneError if a given number is not finite and above 0."""
    for field in fields(given):
        value = getattr(given, field.name)
        if value is not None and not (isfinite(value) and value > 0.0):
            name = field.name.replace("_", " ")
            raise SceneError(f"the {name} of the {what} is {value:g}; it must be above 0")


@dataclass(frozen=True)
class QuarterCar:
    """One wheel and the mass that it brakes; SI.

    mass: kg; inertia: of the wheel about its axle, kg m2; radius: of the wheel, m; load: on the
    wheel, N, by default the weight of the mass. The defaults are assumptions for a typical
    passenger car.
    """

    mass: float = 350.0
    inertia: float = 1.0
    radius: float = 0.3
    load: float | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that are not above 0 (SceneError)."""
        _check_positive(self, "car")

    @property
    def wheel_load(self) -> float:
        """Wheel load, N."""
        return self.mass * GRAVITY if self.load is None else self.load


@dataclass(frozen=True)
class Brake:
    """Its torque rises from 0 to the `largest_torque` (N m) within the `ramp_time` (s).

    The defaults are assumptions: several times the friction of ice, and hard braking.
    """

    largest_torque: float = 1500.0
    ramp_time: float = 0.2

    def __post_init__(self) -> None:
        """Refuse numbers that are not above 0 (SceneError)."""
        _check_positive(self, "brake")

    @property
    def rise(self) -> float:
        """Rate of the torque, N m/s."""
        return self.largest_torque / self.ramp_time


@dataclass(frozen=True)
class Threshold:
    """Control of the slip by two thresholds, as in a simple anti-lock brake.

    The torque falls at the rate `release` (N m/s) after the slip ratio exceeds `high`, and rises at
    the rate `build` (N m/s) after it falls to `low`. The defaults are assumptions: fast release and
    slow build-up of pressure.
    """

    high: float = 0.3
    low: float = 0.1
    release: float = 5000.0
    build: float = 1000.0

    def __post_init__(self) -> None:
        """Refuse rates of 0 and thresholds in the wrong order (SceneError)."""
        _check_positive(self, "threshold control")
        if not self.low < self.high < 1.0:
            raise SceneError(
                f"thresholds of the slip ratio are {self.low:g} and {self.high:g}; needed: "
                "0 < low < high < 1"
            )
