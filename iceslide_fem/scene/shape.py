"""Cuts in the built-in block, and checks of their fit."""

from __future__ import annotations

from itertools import pairwise
from math import inf, tan
from typing import Annotated, Any, Literal, Protocol, Self

from pydantic import Discriminator, Tag, model_validator

from iceslide_fem.scene.units import Quantity, Table

Position = Annotated[float, Quantity("m", "-0.5 m", "0.5 m")]
Size = Annotated[float, Quantity("m", "10 um", "1 m")]
Cut = Annotated[float, Quantity("m", "0 m", "10 mm")]
Tilt = Annotated[float, Quantity("rad", "-40 deg", "40 deg")]

DEEPEST = 0.9  # of the height: the rest holds the lugs
LARGEST_EDGE = 0.2  # largest cut of an edge, of a lug, of the height and of a depth
SMALLEST_EDGE = 1e-6  # m
WIDEST = 0.5  # of the distance of evenly spaced sipes


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


class Shaped(Protocol):
    """Shape parameters of a block (`Rubber`): lengths in m, angle in rad."""

    @property
    def length(self) -> float: ...
    @property
    def width(self) -> float: ...
    @property
    def height(self) -> float: ...
    @property
    def edge_radius(self) -> float: ...
    @property
    def chamfer(self) -> float: ...
    @property
    def draft_angle(self) -> float: ...
    @property
    def grooves(self) -> tuple[Groove, ...]: ...
    @property
    def mesh(self) -> object: ...
    @property
    def outline(self) -> object: ...
    @property
    def sipes(self) -> int | tuple[Sipe, ...]: ...
    @property
    def cuts(self) -> tuple[Sipe, ...]: ...


def evenly_spaced(count: int, length: float, width: float, depth: float) -> tuple[Sipe, ...]:
    """`count` straight sipes in a block of this length."""
    places = (length * (n / (count + 1) - 0.5) for n in range(1, count + 1))
    return tuple(Sipe.model_construct(position=place, width=width, depth=depth) for place in places)


def check_shape(rubber: Shaped) -> None:
    """Raise ValueError if the cuts do not fit into the block, or contradict mesh or outline."""
    given = {
        "rubber.sipes": bool(rubber.cuts),
        "rubber.grooves": bool(rubber.grooves),
        "rubber.edge_radius": rubber.edge_radius > 0.0,
        "rubber.chamfer": rubber.chamfer > 0.0,
        "rubber.draft_angle": rubber.draft_angle > 0.0,
    }
    named = [key for key, there in given.items() if there]
    if rubber.mesh is not None and rubber.outline is not None:
        raise ValueError("rubber.outline and rubber.mesh contradict each other; give one of them")
    for other in ("mesh", "outline"):
        if named and getattr(rubber, other) is not None:
            swept = other == "outline" and named[0] not in ("rubber.sipes", "rubber.grooves")
            way = (
                "an outline has sharp edges and upright sides; draw it in a mesh"
                if swept
                else f"it is cut into the built-in box only; draw it in the {other}"
            )
            raise ValueError(f"{named[0]} and rubber.{other} contradict each other: {way}")
    if rubber.edge_radius > 0.0 and rubber.chamfer > 0.0:
        raise ValueError(
            "rubber.edge_radius and rubber.chamfer contradict each other: an edge is round or cut "
            "off; give one of them"
        )
    _check_depths(rubber)
    _check_lugs(rubber)
    _check_grooves(rubber)


def _check_depths(rubber: Shaped) -> None:
    depths = [(f"grooves.{n}.depth", groove.depth) for n, groove in enumerate(rubber.grooves)]
    if isinstance(rubber.sipes, int):
        depths += [("sipe_depth", sipe.depth) for sipe in rubber.cuts]
    else:
        depths += [(f"sipes.{n}.depth", sipe.depth) for n, sipe in enumerate(rubber.sipes)]
    for key, depth in depths:
        if depth > DEEPEST * rubber.height:
            raise ValueError(
                f"rubber.{key} = {1e3 * depth:.3g} mm is too deep; allowed: up to "
                f"{DEEPEST:g} rubber.height = {DEEPEST * 1e3 * rubber.height:.3g} mm"
            )


def _check_lugs(rubber: Shaped) -> None:
    """Raise ValueError if sipes overlap or leave no room for edge cuts."""
    half = rubber.length / 2
    walls = [(-half, -half)]
    walls += [*(cut.walls for cut in rubber.cuts), (half, half)]
    thinnest = inf
    for (_, begin), (end, _) in pairwise(walls):
        thinnest = min(thinnest, end - begin)
    if thinnest < 1e-5:
        raise ValueError(
            f"rubber.sipes overlap each other or an end of the block ({1e3 * rubber.length:.3g} mm "
            "long); allowed: at least 0.01 mm of rubber between them"
        )
    edge, name = _edge(rubber)
    if 0.0 < edge < SMALLEST_EDGE:
        raise ValueError(
            f"rubber.{name} = {1e6 * edge:.3g} um is too small to be meshed; allowed: 0, or at "
            f"least {1e6 * SMALLEST_EDGE:g} um"
        )
    depths = [cut.depth for cut in rubber.cuts] + [cut.depth for cut in rubber.grooves]
    most = LARGEST_EDGE * min(thinnest, rubber.height, *depths)
    if edge > most * (1.0 + 1e-9):
        raise ValueError(
            f"rubber.{name} = {1e3 * edge:.3g} mm is too large; allowed: up to "
            f"{1e3 * most:.3g} mm, {LARGEST_EDGE:g} of the shortest lug, of the height, and of the "
            "depth of sipes and grooves"
        )
    most = DEEPEST * half / rubber.height
    if tan(rubber.draft_angle) > most:
        raise ValueError("rubber.draft_angle is too large for a block as tall as this")


def check_room_across(rubber: Shaped) -> None:
    """Raise ValueError if grooves and sides leave no room for edge cuts along x (block only)."""
    begin, narrowest = 0.0, rubber.width
    for groove in sorted(rubber.grooves, key=lambda groove: groove.position):
        low, high = groove.position - groove.width / 2, groove.position + groove.width / 2
        if groove.position > 0.0:  # the middle lug is halved at y = 0
            narrowest = min(narrowest, (low - begin) * (1 if begin else 2))
        begin = high
    narrowest = min(narrowest, (rubber.width / 2 - begin) * (1 if begin else 2))
    edge, name = _edge(rubber)
    most = LARGEST_EDGE * narrowest
    if edge > most * (1.0 + 1e-9):
        raise ValueError(
            f"rubber.{name} = {1e3 * edge:.3g} mm is too large; allowed in a block: up to "
            f"{1e3 * most:.3g} mm, {LARGEST_EDGE:g} of its width, or of a lug's between grooves"
        )


def _edge(rubber: Shaped) -> tuple[float, str]:
    """Size of the edge cut, m, and its key."""
    return max((rubber.edge_radius, "edge_radius"), (rubber.chamfer, "chamfer"))


def _check_grooves(rubber: Shaped) -> None:
    edge = rubber.width / 2
    reached = 0.0
    for groove in sorted(rubber.grooves, key=lambda groove: groove.position):
        low, high = groove.position - groove.width / 2, groove.position + groove.width / 2
        centred = groove.position == 0.0
        if (low < reached + 1e-5 and not centred) or (centred and reached) or high > edge - 1e-5:
            raise ValueError(
                "rubber.grooves overlap each other, the middle plane or a side of the block; "
                "allowed: at least 0.01 mm of rubber between them, on y = 0 only position = 0"
            )
        reached = high
