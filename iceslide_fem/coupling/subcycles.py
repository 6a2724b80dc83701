"""Film and heat over a coupled step, in substeps of their own: what there is of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import ContactLoads, InterfaceStep
from iceslide_fem.runtime.arrays import Array


class Subcycles(NamedTuple):
    """Film and heat over a coupled step.

    substeps; ends: of each, as a fraction of the coupled step; loads: of the points there; next_dt:
    length of the substep that film and heat would make next, s.
    """

    substeps: tuple[InterfaceStep, ...]
    ends: tuple[float, ...]
    loads: tuple[ContactLoads, ...]
    next_dt: float

    def first(self, count: int) -> Subcycles:
        """Of its first `count` substeps, fewer than it has."""
        reached, then = self.ends[count - 1], float(self.substeps[count].step.dt)
        ends = tuple(end / reached for end in self.ends[:count])
        return Subcycles(self.substeps[:count], ends, self.loads[:count], then)

    @property
    def state(self) -> InterfaceState:
        """Film and heat at the end."""
        return self.substeps[-1].state

    @property
    def area(self) -> Array:
        """What each film of each substep stands for, one after the other, m2."""
        return np.concatenate([one.area for one in self.substeps])
