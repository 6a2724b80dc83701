"""Results of a stop: history, distance, time, deceleration and works."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from iceslide_fem.preprocess.wheel.slip_table import KMH
from iceslide_fem.runtime.arrays import Array


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

    def __str__(self) -> str:
        """One line with speeds, distance, time and deceleration."""
        first, last = KMH * self.history.speed[[0, -1]]
        return (
            f"from {first:.4g} km/h to {last:.4g} km/h in {self.distance:.4g} m, "
            f"{self.time:.4g} s, at {self.deceleration:.3g} m/s2"
        )
