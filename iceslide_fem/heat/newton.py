"""Newton's method for the heat balance of films and bodies in a stage.

The heat of a film falls with the temperature below it, steeply where it melts. The balance is
therefore the minimum of a convex function, whose slope is what the bodies take less what the films
give. Full steps find it in a few iterations: this is the primal-dual active set method where films
only switch between two lines (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865).
They may go round in a circle; after some iterations a line search follows each of them. Meshed ice
(`balance`) and ice in modes (`interface.ice_balance`) share this method.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, Self, TypeVar

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged

FULL_STEPS = 16  # before line searches
MOST_TRIALS = 30  # of a line search
NOT_FOUND = "the melting part of the ice's surface is not found"


class Guess(Protocol):
    """Temperatures, and the heat that films give and bodies take there."""

    @property
    def settled(self) -> bool:
        """Whether they are the balance. Collective. Raises NotConverged if they are not finite."""

    def change(self) -> Array:
        """The Newton step. Collective. Raises NotConverged."""

    def along(self, change: Array) -> tuple[float, Callable[[float], tuple[float, Self]]]:
        """Slope of the convex function along a `change`, and both after a fraction of it.
        Collective.
        """


Some = TypeVar("Some", bound=Guess)


def balanced(guess: Some, most: int, enough: float) -> tuple[Some, int]:
    """The balance, and the number of Newton steps to it, at most `most`.

    enough: largest slope at the end of a line search over the first one; the first steps are full.
    Collective. Raises NotConverged.
    """
    for changes in range(most):
        if guess.settled:
            return guess, changes
        guess = _searched(guess, enough if changes >= FULL_STEPS else np.inf)
    raise NotConverged(NOT_FOUND)


def _searched(guess: Some, enough: float) -> Some:
    """The guess after a fraction of a Newton step at which the slope is about zero.

    The full step is taken unless it goes well past the minimum. Then points that melt stop melting,
    and the next step would undo this one. Secants and bisections alternate in the bracket of the
    zero, because the slope has kinks.
    """
    first, at = guess.along(guess.change())
    length, low, below, high, above = 1.0, 0.0, first, np.inf, 0.0
    for trial in range(MOST_TRIALS):
        slope, there = at(length)
        if not first < 0.0:  # rounding
            break
        if slope <= -enough * first and (length == 1.0 or slope >= enough * first):
            break
        if slope > 0.0:
            high, above = length, slope
        else:
            low, below = length, slope
        part = below / (below - above) if trial % 2 == 0 else 0.5
        length = low + (high - low) * part
    return there
