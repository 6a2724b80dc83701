"""Sliding contact below a wheel: what the brush model asks of a friction law."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.preprocess.footprint.film_map import Start
from iceslide_fem.preprocess.wheel.brush import Ends
from iceslide_fem.runtime.arrays import Array, Mask

SLOWEST = 1e-6  # m/s, below which the wheel is at rest


class Slid(NamedTuple):
    """Results of sliding pixels, (n, nx), the first column at the leading edge.

    stress: friction at both ends, Pa; at the exit: temperature of the ice's surface, K; height of
    the film, m, NaN for a law without films; melting, saturated: masks of the switches. ahead:
    makes the lines ahead of the next pass, None without films.
    """

    stress: Ends
    temperature: Array
    height: Array
    melting: Mask
    saturated: Mask
    ahead: Callable[[], Start] | None = None

    def lines(self, some: slice) -> Slid:
        """The results of `some` of the lines."""
        first, last = self.stress
        temperature, height = self.temperature[some], self.height[some]
        switches = self.melting[some], self.saturated[some]
        return Slid(Ends(first[some], last[some]), temperature, height, *switches)


class Onset(NamedTuple):
    """Friction stress (Pa) of rubber that begins to slide at its speed, and at rest."""

    begins: Ends
    rests: Ends

    @property
    def static(self) -> Ends:
        """The largest friction stress of rubber that sticks."""
        pairs = zip(self.begins, self.rests, strict=True)
        return Ends(*(np.maximum(one, other) for one, other in pairs))


class SlidingContact(Protocol):
    """A friction law, as the brush model uses it."""

    @property
    def passes(self) -> int:
        """Number of passes over the same ice."""

    def after(self, slid: Slid) -> SlidingContact:
        """The contact of the pass after `slid`."""

    def onset(self, pressure: Array, dx: Array, passing: Array, speed: Array) -> Onset:
        """Friction stress where sliding begins; arguments as of `slid`, below rubber that sticks.

        Raises SimulationStopped if a step fails.
        """

    def slid(self, pressure: Array, slides: Mask, dx: Array, passing: Array, speed: Array) -> Slid:
        """Sliding contact under `pressure` (n, nx), Pa, where it `slides`; elsewhere it sticks.

        dx: length of the pixels of a line, m; passing, speed: of the ice and of sliding, m/s, (n,).
        Raises SimulationStopped if a step fails.
        """
