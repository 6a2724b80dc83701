"""Points under any friction law, for the integrator of points (`film.point.integrate`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.driving import SHORTER, PointLoads
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.course import Course


class LawDrive(NamedTuple):
    """Points under `law`, with pressure (Pa) and slip speed (m/s) over time.

    fractions: of the pressure at each point, (n,).
    """

    law: InterfaceLaw
    pressures: Course
    speeds: Course
    fractions: Array

    @property
    def advice(self) -> str:
        """What to do if a step fails; a film that freezes to nothing has no limit of its shear."""
        freezes = self.law.wet is not None and self.law.viscous
        return (
            "where its film freezes only film.dry_stress limits its shear" if freezes else SHORTER
        )

    @property
    def constant(self) -> bool:
        """Whether loads and contact are constant."""
        steady = self.pressures.is_constant and self.speeds.is_constant
        return steady and not len(self.law.untouched(0))

    def loads(self, time: Array, age: Array) -> PointLoads:
        """Loads at a time, with the history of the contact."""
        return self.law.loads(self.pressure(time), self.speeds(time), age)

    def pressure(self, time: Array) -> Array:
        """Pressure, Pa."""
        return self.fractions * self.pressures(time)

    def next_corner(self, time: Array) -> Array:
        """Time of the next kink, s."""
        return np.minimum(self.pressures.next_corner(time), self.speeds.next_corner(time))

    def aged(self, age: Array, time: Array, dt: Array, kelvin: Array | None) -> Array:
        """History of the contact `dt` (s) after `time`."""
        start, end = self.pressure(time), self.pressure(time + dt)
        return self.law.aged(age, start, end, dt, kelvin)

    def together(self, dt: Array) -> Array:
        """Steps of one length under a law without films, which is given one length."""
        return dt if self.law.has_film else np.full_like(dt, dt.min())

    def agreed(self, good: Mask) -> Mask:
        """All or none under a law without films."""
        return good if self.law.has_film else np.full_like(good, good.all())

    def check(self, time: Array) -> None:
        """Raise SimulationStopped if the law has returned an invalid result, at `time` (s)."""
        if self.law.fault:
            at = 1e3 * float(time.min())
            raise SimulationStopped(f"{self.law.fault}; the run stops at t = {at:.4g} ms")

    def subject(self, number: int, time: Array) -> str:
        """The film by pressure and speed, or the law."""
        if not self.law.has_film:
            return f"the friction law {self.law.name}"
        p, speed = self.pressure(time)[number], self.speeds(time)[number]
        return f"the film at {p:.4g} Pa and {speed:.4g} m/s"

    def take(self, index: Index) -> LawDrive:
        """The same at the points of `index`."""
        return self._replace(fractions=self.fractions.take(index, mode="clip"))
