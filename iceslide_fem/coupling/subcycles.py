"""The result of subcycling: film and heat over a coupled step, in substeps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import ContactLoads, InterfaceStep
from iceslide_fem.runtime.arrays import Array


class Subcycles(NamedTuple):
    """Substeps of film and heat over a coupled step.

    substeps: their results; ends: their ends, as fractions of the coupled step; loads: contact
    loads at these ends; next_dt: length that the errors allow for the next substep, s.
    """

    substeps: tuple[InterfaceStep, ...]
    ends: tuple[float, ...]
    loads: tuple[ContactLoads, ...]
    next_dt: float

    def first(self, count: int) -> Subcycles:
        """The first `count` substeps, fewer than all, rescaled to their end."""
        reached, then = self.ends[count - 1], float(self.substeps[count].step.dt)
        ends = tuple(end / reached for end in self.ends[:count])
        return Subcycles(self.substeps[:count], ends, self.loads[:count], then)

    @property
    def state(self) -> InterfaceState:
        """Film and heat at the end."""
        return self.substeps[-1].state

    @property
    def area(self) -> Array:
        """Area of each film in each substep, substep after substep, m2."""
        return np.concatenate([one.area for one in self.substeps])
