"""The state of the interface and its loads, as the time integrator uses them."""

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
    """State of the interface: ln h and H_s (m) per film, heat states of ice and rubber.

    internal: internal variables (m, n), see `film.law.FilmHistory`. The film law has them only with
    a temperature-dependent viscosity or a contact age.
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
    """Loads of the interface in a stage of a step."""

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None,
        close: float,
    ) -> Film:
        """The law in an implicit stage of `dt` (s) from `start`, in a step that starts at `before`.

        `near` and `close` control the search of heights, see `film.height.log_height_of`.
        """

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables at the end of the `stage`, from those `before` it."""


class Begun(Protocol[End]):
    """A step with a given start."""

    def at(self, end: End, fraction: float) -> InStage:
        """Loads at `fraction` of a step that ends with the loads `end`."""


class Acting(Protocol):
    """Loads of the interface at one end of a step, as the integrator uses them."""

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> Begun[Self]:
        """A step of `dt` (s) that starts with these loads, from `state`, between both bodies."""
