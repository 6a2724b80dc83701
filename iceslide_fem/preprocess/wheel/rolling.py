"""Kinematics of a wheel: speeds of its tread on the ice."""

from __future__ import annotations

from math import cos, hypot, inf, sin
from typing import NamedTuple


class Rolling(NamedTuple):
    """A wheel whose centre moves with `speed` V (m/s), at a `slip_angle` alpha (rad) to its plane.

    Its circumference moves with V cos(alpha) (1 - S). The `slip` ratio S is 1 for a locked wheel, 0
    for free rolling, and negative for a driven wheel.
    """

    speed: float
    slip: float
    slip_angle: float = 0.0

    @property
    def forward(self) -> float:
        """Speed of the ice along the patch, m/s."""
        return self.speed * cos(self.slip_angle)

    @property
    def sliding(self) -> tuple[float, float]:
        """Sliding velocity of the tread over the ice along and across the wheel's plane, m/s."""
        return self.forward * self.slip, self.speed * sin(self.slip_angle)

    @property
    def sliding_speed(self) -> float:
        """Magnitude w of the sliding velocity, m/s."""
        return hypot(*self.sliding)

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector of the friction force against the motion, along and across; 0 at rest."""
        along, across = self.sliding
        size = self.sliding_speed
        return (along / size, across / size) if size else (0.0, 0.0)

    @property
    def stretch(self) -> float:
        """sigma: stretch of a sticking bristle per distance through the patch.

        It is w over the speed of the tread through the patch, infinite for a locked wheel; S / (1 -
        S) without a slip angle.
        """
        passing = self.forward * (1.0 - self.slip)
        return self.sliding_speed / passing if passing > 0.0 else (inf if self.slip > 0.0 else 0.0)
