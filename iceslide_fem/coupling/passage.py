"""Film and heat over a coupled step, in sub-steps of their own: what such a passage is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.carriers import ContactLoads, InterfaceStep


class Passage(NamedTuple):
    """Film and heat over a coupled step.

    steps: the sub-steps; ends: of each, as a share of the whole; loads: of the points there;
    following: length of the sub-step that film and heat would make next, s.
    """

    steps: tuple[InterfaceStep, ...]
    ends: tuple[float, ...]
    loads: tuple[ContactLoads, ...]
    following: float

    def first(self, parts: int) -> Passage:
        """A passage of its first `parts`, fewer than it has."""
        reached, then = self.ends[parts - 1], float(self.steps[parts].step.dt)
        ends = tuple(end / reached for end in self.ends[:parts])
        return Passage(self.steps[:parts], ends, self.loads[:parts], then)

    @property
    def state(self) -> InterfaceState:
        """Film and heat at the end."""
        return self.steps[-1].state

    @property
    def area(self) -> Array:
        """What each film of each sub-step stands for, one after the other, m2."""
        return np.concatenate([one.area for one in self.steps])
