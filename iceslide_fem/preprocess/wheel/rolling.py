"""How a wheel rolls and slips: the speeds of its tread on the ice."""

from __future__ import annotations

from math import cos, hypot, inf, sin
from typing import NamedTuple


class Rolling(NamedTuple):
    """A wheel whose centre moves with `speed` V (m/s), at a `slip_angle` alpha (rad) to its plane.

    Its circumference moves with V cos(alpha) (1 - S): the `slip` ratio S is 1 of a locked wheel, 0
    of one that rolls freely, and below 0 of one that is driven.
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
        """Its size w, m/s."""
        return hypot(*self.sliding)

    @property
    def direction(self) -> tuple[float, float]:
        """That of the friction force against the wheel's motion, along and across; none at rest."""
        along, across = self.sliding
        size = self.sliding_speed
        return (along / size, across / size) if size else (0.0, 0.0)

    @property
    def stretch(self) -> float:
        """sigma: by how much a bristle that sticks is stretched over its way through the patch.

        w over the speed with which the tread passes the patch; infinite of a locked wheel. Without
        a slip angle S / (1 - S).
        """
        passing = self.forward * (1.0 - self.slip)
        return self.sliding_speed / passing if passing > 0.0 else (inf if self.slip > 0.0 else 0.0)
