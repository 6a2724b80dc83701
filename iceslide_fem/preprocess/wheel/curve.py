"""Friction over slip of a family of speeds and temperatures."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.doubts import MOST
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import SlipPoint, Tread, friction
from iceslide_fem.preprocess.wheel.law import contact_of_case
from iceslide_fem.runtime.units import ZERO_CELSIUS

SMALL = 1e-4  # slip ratio for the slope at 0
TOGETHER = 2_000_000  # largest number of pixels of all slip ratios per call


class Curve(NamedTuple):
    """Friction of one wheel over its slip ratios, ascending.

    speed: of the vehicle, m/s; temperature: of the ice, K; slope: dmu/dS at S = 0, from mu at the
    slip ratio 1e-4.
    """

    speed: float
    temperature: float
    points: list[SlipPoint]
    slope: float

    @property
    def peak(self) -> SlipPoint | None:
        """The point of the largest braking friction; None without slip ratios above 0."""
        return max(self.braking, key=lambda point: point.mu, default=None)

    @property
    def locked(self) -> SlipPoint | None:
        """The point of the locked wheel, if it is computed."""
        return next((point for point in self.points if point.slip == 1.0), None)

    @property
    def braking(self) -> list[SlipPoint]:
        """Points above S = 0."""
        return [point for point in self.points if point.slip > 0.0]

    @property
    def without_melting(self) -> list[float]:
        """Slip ratios at which rubber slides and ice melts on less than half of the contact."""
        return [p.slip for p in self.points if p.sliding > 0.0 and p.melting < 1.0 - MOST]

    @property
    def name(self) -> str:
        """Name in pictures."""
        return f"{3.6 * self.speed:.4g} km/h, {self.temperature - ZERO_CELSIUS:.4g} °C"


def curves(
    case: WheelCase,
    footprint: PressureMap,
    stiffness: float,
    tell: Callable[[float], None] = lambda fraction: None,
) -> list[Curve]:
    """Every member of the family on `footprint`; stiffness: c of the tread (Pa/m).

    tell: called with the finished fraction. Raises SceneError, before computing, if a law does not
    fit a wheel, and SimulationStopped if a step fails.
    """
    contacts = [
        (member, contact_of_case(member, footprint.contact_length)) for member in case.members
    ]
    tread = Tread(stiffness, case.pattern)
    phases = 1 if tread.pattern is None else tread.pattern.phases
    together = max(1, TOGETHER // (phases * footprint.pressure.size))
    slips = np.array([*case.slip, SMALL])
    parts = np.array_split(slips, -(-slips.size // together))
    found = []
    for number, (member, contact) in enumerate(contacts):
        points: list[SlipPoint] = []
        for part in parts:
            rolls = [member.rolling(float(slip)) for slip in part]
            points += friction(footprint, rolls, tread, contact)
            tell((number + len(points) / slips.size) / len(contacts))
        *asked, small = points
        found.append(Curve(member.speed, member.temperature, asked, small.mu / SMALL))
    return found
