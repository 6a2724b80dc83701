"""Points whose k, D and H_V depend on the contact's age (`contact_age`), so on time only.

The contact begins `YOUNGEST` before t = 0: some relaxation times are too short for any step. The
rubber has the temperature of the conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from iceslide_fem.film.contact_age import ContactAge
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.contact_table import ContactParameters

# Parts of a linear piece of the pressure history. The largest p_e is updated after each.
PARTS = 8
YOUNGEST = 1e-8  # of the duration


@dataclass(frozen=True)
class AgedLoading:
    """The contact `age` under the constant pressures of the conditions, or under `loads`."""

    age: ContactAge
    loads: Loading | None = None

    def at(self, here: Conditions, time: Array) -> Conditions:
        """The conditions at `time` (s, one per point)."""
        if self.loads is None or self.loads.pressure.is_constant:
            here = here if self.loads is None else self.loads.at(here, time)
            old = time + YOUNGEST * here.duration
            k, D, H_V, _ = self.age.under_constant(here.pressure, old, here.temperature)
            return here._replace(k=k, D=D, H_V=H_V)
        here = self.loads.at(here, time)
        k, D, H_V = np.empty((3, time.size))
        for temperature in np.unique(here.temperature):
            of = np.flatnonzero(here.temperature == temperature)
            found = self._under_course(here.pressure[of], time[of], float(temperature))
            k[of], D[of], H_V[of] = found[:3]
        return here._replace(k=k, D=D, H_V=H_V)

    def next_corner(self, time: Array) -> Array:
        """Time of the next kink of a load (s)."""
        return np.full_like(time, np.inf) if self.loads is None else self.loads.next_corner(time)

    def _under_course(self, pressure: Array, time: Array, temperature: float) -> ContactParameters:
        """k, D and H_V at `time` (s) under the pressure (Pa) at that time."""
        times, pressures = self._parts
        before = np.maximum(times.searchsorted(time) - 1, 0)
        reduced = self.age.relaxation.reduced(time - times[before], temperature)
        history = self._histories(temperature)[:, before]
        now = self.age.after(history, pressures[before], pressure, pressure, reduced)
        return self.age.so_far(now)(pressure)

    def _histories(self, temperature: float) -> Array:
        """History variables at the ends of all parts, (rows, n), for one rubber temperature (K)."""
        if temperature not in self._known:
            times, pressures = self._parts
            steps = self.age.relaxation.reduced(np.diff(times), temperature)
            first = pressures[:1]
            young = self.age.relaxation.reduced(np.full(1, YOUNGEST * times[-1]), temperature)
            history = [self.age.after(self.age.fresh(1), first, first, first, young)]
            for number, step in enumerate(steps):
                start, end = pressures[number : number + 1], pressures[number + 1 : number + 2]
                history.append(self.age.after(history[-1], start, end, end, np.array([step])))
            self._known[temperature] = np.concatenate(history, axis=1)
        return self._known[temperature]

    @cached_property
    def _known(self) -> dict[float, Array]:
        return {}

    @cached_property
    def _parts(self) -> tuple[Array, Array]:
        """Times (s) of the piecewise linear pressure history, and its values (Pa)."""
        assert self.loads is not None
        course = self.loads.pressure
        ends = np.array([0.0, *course.corners, course.duration])
        parts = np.arange(PARTS) / PARTS
        inside = (ends[:-1, None] + parts * np.diff(ends)[:, None]).ravel()
        times = np.append(inside, ends[-1])
        return times, course(times)
