"""The tread of a wheel: its shear stiffness, relaxation and pattern."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.block_shear import block_stiffness
from iceslide_fem.preprocess.wheel.brush import Memory, Pattern
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import celsius


class Tread(NamedTuple):
    """Instantaneous shear stiffness c of the tread (Pa/m), its pattern, or None, and the Prony
    series of c at the tread's temperature; without arms it is elastic.
    """

    stiffness: float
    pattern: Pattern | None = None
    arms: Prony = Prony()

    def memory(self, time: Array) -> Memory:
        """How its bristles relax over the `time` (s) of a pixel, (n,)."""
        return Memory.over(time, self.arms)

    def after(self, time: float) -> float:
        """Stress over stretch (Pa/m) of a bristle that sticks for a `time` (s):

        c [1 - sum g_i (1 - tau_i (1 - exp(-t / tau_i)) / t)].
        """
        memory = self.memory(np.array([time]))
        return float(self.stiffness * (memory.long_term + memory.gained.sum()))


class TreadStiffness(NamedTuple):
    """c (Pa/m): shear stress over displacement of the tread's surface; source: its origin.

    value: long-term, without the carcass; relaxation: of c, or None; carcass: stiffness in series
    with that of the tread, Pa/m, or None.
    """

    value: float
    source: str
    relaxation: Relaxation | None = None
    carcass: float | None = None

    def tread(self, pattern: Pattern | None, temperature: float) -> Tread:
        """The tread at a `temperature` (K).

        Raises SceneError if the shift of its relaxation times is unknown there.
        """
        arms = Prony()
        if self.relaxation is not None:
            slower = float(self.relaxation.shift(temperature))
            if not np.isfinite(slower):
                raise SceneError(
                    f"the rubber of the tread has no shift at {celsius(temperature)}; allowed: "
                    "warmer ice, or arrhenius_below and activation_energy"
                )
            arms = self.relaxation.prony.slowed(slower)
        stiffness = self.value / arms.long_term
        if self.carcass is None:
            return Tread(stiffness, pattern, arms)
        ratio = stiffness / self.carcass
        return Tread(stiffness / (1.0 + ratio), pattern, arms.in_series(ratio))


def stiffness_of(
    case: WheelCase,
    footprint: PressureMap,
    tell: Callable[[str], None] = lambda words: None,
) -> TreadStiffness:
    """The stiffness of the tread of a case.

    A given number does not relax: that of a given c_p (N/m2, force per length of the patch and
    displacement) is divided by the patch's width in contact. A slick tread has G / H. A pattern has
    the stiffness of one block by finite elements; `tell` is called before them. Both relax as the
    rubber does. Raises SceneError if they cannot run.
    """
    given, height, carcass = case.stiffness, case.tread_height, case.carcass
    if given is not None and given.unit == "Pa/m":
        return TreadStiffness(given.value, "given", None, carcass)
    if given is not None:
        width = width_in_contact(footprint)
        source = f"given as {given.value:.4g} N/m2, over {1e3 * width:.4g} mm of width"
        return TreadStiffness(given.value / width, source, None, carcass)
    rubber, relaxation, pattern = case.law.long_term, case.law.rubber.relaxation, case.pattern
    shear = rubber.shear_modulus
    if pattern is None:
        value = shear / height
        source = f"G / H = {shear / 1e6:.4g} MPa / {1e3 * height:.4g} mm of a slick tread"
    else:
        tell("shear of a block by finite elements")
        length = pattern.pitch - pattern.groove
        value = block_stiffness(rubber, length, height)
        size = f"{1e3 * length:.4g} mm long and {1e3 * height:.4g} mm high"
        source = f"finite elements of a block, {size}"
    if relaxation is not None:
        source += ", long-term, of rubber that relaxes"
    return TreadStiffness(value, source, relaxation, carcass)


def width_in_contact(footprint: PressureMap) -> float:
    """Area in contact over the patch's length, m."""
    return footprint.contact_area / footprint.contact_length
