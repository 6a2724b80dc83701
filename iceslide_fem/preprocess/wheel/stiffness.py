"""Shear stiffness of a tread: given, in closed form, or by finite elements of a block."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.block_shear import block_stiffness
from iceslide_fem.preprocess.wheel.case import WheelCase


class TreadStiffness(NamedTuple):
    """c (Pa/m): shear stress over displacement of the tread's surface; source: its origin."""

    value: float
    source: str


def stiffness_of(
    case: WheelCase,
    footprint: PressureMap,
    tell: Callable[[str], None] = lambda words: None,
) -> TreadStiffness:
    """The stiffness of the tread of a case.

    A given c_p (N/m2, force per length of the patch and displacement) is divided by the patch's
    width in contact. A slick tread has G / H. A pattern has the stiffness of one block by finite
    elements; `tell` is called before them. Raises SceneError if they cannot run.
    """
    given, height = case.stiffness, case.tread_height
    if given is not None and given.unit == "Pa/m":
        return TreadStiffness(given.value, "given")
    if given is not None:
        width = width_in_contact(footprint)
        return TreadStiffness(
            given.value / width,
            f"given as {given.value:.4g} N/m2, over {1e3 * width:.4g} mm of width",
        )
    shear, pattern = case.rubber.shear_modulus, case.pattern
    if pattern is None:
        return TreadStiffness(
            shear / height,
            f"G / H = {shear / 1e6:.4g} MPa / {1e3 * height:.4g} mm of a slick tread",
        )
    tell("shear of a block by finite elements")
    length = pattern.pitch - pattern.groove
    return TreadStiffness(
        block_stiffness(case.rubber, length, height),
        f"finite elements of a block, {1e3 * length:.4g} mm long and {1e3 * height:.4g} mm high",
    )


def width_in_contact(footprint: PressureMap) -> float:
    """Area in contact over the patch's length, m."""
    return footprint.contact_area / footprint.contact_length
