"""The tables of a scene, as what is checked between them reads them."""

from __future__ import annotations

from typing import Protocol

from iceslide_fem.scene.film import Film
from iceslide_fem.scene.friction import Friction
from iceslide_fem.scene.ice import Ice, Water
from iceslide_fem.scene.load import Load
from iceslide_fem.scene.numerics import Numerics
from iceslide_fem.scene.output import Output
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
        """What presses and moves it."""

    @property
    def ice(self) -> Ice:
        """What it slides on."""

    @property
    def film(self) -> Film:
        """The water between both."""

    @property
    def water(self) -> Water:
        """What it is made of."""

    @property
    def friction(self) -> Friction:
        """The friction law."""

    @property
    def numerics(self) -> Numerics:
        """How accurately it is computed."""

    @property
    def output(self) -> Output:
        """What is written."""
