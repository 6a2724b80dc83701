"""The tables of a scene, as checks between tables use them."""

from __future__ import annotations

from typing import Protocol

from iceslide_fem.scene.film import Film, Friction
from iceslide_fem.scene.ice import Ice, Water
from iceslide_fem.scene.load import Load
from iceslide_fem.scene.numerics import Numerics, Output
from iceslide_fem.scene.rubber import Rubber


class Tables(Protocol):
    """The tables of a scene (`scene.model`)."""

    @property
    def model(self) -> str:
        """Its level of the model hierarchy."""

    @property
    def rubber(self) -> Rubber:
        """The block."""

    @property
    def load(self) -> Load:
        """Pressure and speed."""

    @property
    def ice(self) -> Ice:
        """The ice."""

    @property
    def film(self) -> Film:
        """The water film."""

    @property
    def water(self) -> Water:
        """Properties of the film's water."""

    @property
    def friction(self) -> Friction:
        """The friction law."""

    @property
    def numerics(self) -> Numerics:
        """Numerical settings."""

    @property
    def output(self) -> Output:
        """Output settings."""
