"""The interface's history, and what acts on it, as the time integrator asks for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, Self, TypeVar

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.law import Film, FilmHistory, FilmStage
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.runtime.arrays import Array, Index

End = TypeVar("End", contravariant=True)


class InterfaceState(NamedTuple):
    """History of the interface: ln h and H_s (m) per film, heat states of ice and rubber.

    internal: (m, n), see `film.law.FilmHistory`; of the film law only where the viscosity follows
    its temperature, or the contact its age.
    """

    log_height: Array
    squeezed_height: Array
    ice: Array
    rubber: Array = np.zeros((0, 1))
    internal: Array = np.zeros((0, 1))

    def take(self, index: Index) -> InterfaceState:
        """The state at the points of `index`."""
        return InterfaceState(*(part.take(index, axis=-1, mode="clip") for part in self))


class InStage(Protocol):
    """What acts on the interface in a stage of a step."""

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None,
        close: float,
    ) -> Film:
        """The law in an implicit stage of `dt` (s) from `start`, in a step that begins `before`.

        `near` and `close` are for the search of heights, as `film.height.log_height_of` has them.
        """

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables after the `stage`, which were `before` at its start."""


class Begun(Protocol[End]):
    """A step whose start is known."""

    def at(self, end: End, fraction: float) -> InStage:
        """What acts at `fraction` of the step, if it ends with `end`."""


class Acting(Protocol):
    """What acts on the interface at an end of a step, as the integrator asks for it."""

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> Begun[Self]:
        """A step of `dt` (s) that begins here, in `state`, between these bodies."""
