"""Cuts of the built-in block: sipes across the sliding direction, grooves along it."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Tag, model_validator

from iceslide_fem.scene.units import Quantity, Table

WIDEST = 0.5  # of the distance of evenly spaced sipes
Position = Annotated[float, Quantity("m", "-0.5 m", "0.5 m")]
Size = Annotated[float, Quantity("m", "10 um", "1 m")]
Cut = Annotated[float, Quantity("m", "0 m", "10 mm")]
Tilt = Annotated[float, Quantity("rad", "-40 deg", "40 deg")]


class Sipe(Table):
    """A slot across the sliding direction: middle of its mouth, width and depth, m.

    angle: of its walls to the vertical, rad; positive if the end of the slot is ahead of its mouth.
    Its walls may be a `wave` or a zigzag with `amplitude` and `wavelength` (m), `along` the width
    of the block or the depth of the sipe.
    """

    position: Position
    width: Size
    depth: Size
    angle: Tilt = 0.0
    wave: Literal["none", "wave", "zigzag"] = "none"
    along: Literal["width", "depth"] = "width"
    amplitude: Cut = 0.0
    wavelength: Size = 2e-3

    @property
    def walls(self) -> tuple[float, float]:
        """Positions of its walls at the ice, m."""
        return self.position - self.width / 2, self.position + self.width / 2

    @model_validator(mode="after")
    def _waves_are_drawn(self) -> Self:
        if self.wave == "none" and self.amplitude > 0.0:
            raise ValueError(
                f"a sipe's amplitude = {1e3 * self.amplitude:.3g} mm has no effect with wave = "
                '"none"; allowed with it: wave = "wave" or "zigzag"'
            )
        if self.amplitude > 0.3 * self.wavelength:
            raise ValueError(
                f"a sipe's amplitude = {1e3 * self.amplitude:.3g} mm is too large; allowed: up to "
                f"0.3 wavelength = {0.3e3 * self.wavelength:.3g} mm"
            )
        return self


def _many_or_listed(value: Any) -> str:
    return "<listed>" if isinstance(value, list | tuple) else "<counted>"


# A number or a list. Messages omit text in angle brackets.
Sipes = Annotated[
    Annotated[Literal[0, 1, 2, 3, 4, 5, 6, 7, 8], Tag("<counted>")]
    | Annotated[tuple[Sipe, ...], Tag("<listed>")],
    Discriminator(_many_or_listed),
]


class Groove(Table):
    """A slot along the sliding direction, m: distance of its middle from the block's middle plane
    (on both sides of it), width and depth.
    """

    position: Annotated[float, Quantity("m", "0 m", "0.5 m")] = 0.0
    width: Size
    depth: Size


def evenly_spaced(count: int, length: float, width: float, depth: float) -> tuple[Sipe, ...]:
    """`count` straight sipes in a block of this length."""
    places = (length * (n / (count + 1) - 0.5) for n in range(1, count + 1))
    return tuple(Sipe.model_construct(position=place, width=width, depth=depth) for place in places)
