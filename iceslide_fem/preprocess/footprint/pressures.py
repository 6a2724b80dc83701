"""Pressures that are given as numbers: their unit, and whether a tyre presses like that."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import si_unit, to_si
from iceslide_fem.scene.materials import BAR

HIGHEST = 100.0 * BAR
# Mean pressures where a tyre or a block touches, Pa: all that is plausible, and what is usual.
PLAUSIBLE = 5e3, 5e6
USUAL = 2e4, 1.5e6
UNITS = ("Pa", "kPa", "bar", "MPa", "psi", "N/cm^2")
_UNIT_IN_TEXT = re.compile(
    r"[\[(]\s*([^\])]{1,12}?)\s*[\])]|\b(?:in|units?)\b[\s:=]*([^\s,;:]{1,12})|_([A-Za-z0-9/^]{2,7})\b",
    re.IGNORECASE,
)


def units_named(lines: Iterable[str], unit: str = "Pa") -> list[str]:
    """Units of the dimension of the SI `unit` that lines above a table name, each once.

    As in "Pressure (kPa)", "Units: kPa", "p in bar", "p_bar".
    """
    found: list[str] = []
    for line in lines:
        for match in _UNIT_IN_TEXT.finditer(line):
            written = next(part for part in match.groups() if part is not None)
            given = si_unit(written, unit)
            if given is not None and given not in found:
                found.append(given)
    return found


def pressure_unit(named: list[str], option: str | None, said: str) -> str:
    """The unit of pressures: that `named` in the file, else that of --pressure-unit, else Pa.

    Raises SceneError where they contradict each other.
    """
    factors = {to_si(f"1 {unit}", "Pa") for unit in named}
    if len(factors) > 1 and option is None:
        raise SceneError(f"{said} names the units {', '.join(named)}; --pressure-unit says which")
    if len(factors) == 1 and option is not None and to_si(f"1 {option}", "Pa") not in factors:
        raise SceneError(f"--pressure-unit {option} contradicts {said}, which is in {named[0]}")
    return option or (named[0] if named else "Pa")


def check_pressures(values: Array, said: str, unit: str) -> None:
    """Raise SceneError if pressures (Pa) are negative, nowhere above 0, or above 100 bar."""
    low, high = float(values.min()), float(values.max())
    factor = to_si(f"1 {unit}", "Pa")
    if low < 0.0 or high > HIGHEST:
        raise SceneError(
            f"{said} has pressures from {low / factor:.4g} to {high / factor:.4g} {unit}; allowed: "
            f"0 to {HIGHEST / factor:.4g} {unit}{_other_units(values, unit)}"
        )
    if not high > 0.0:
        raise SceneError(f"{said}: no pressure is above 0, nothing is in contact")


def check_plausible(pressure: Array, said: str, unit: str) -> None:
    """Raise SceneError unless the mean of pressures (Pa) above 0 is one of a tyre or a block.

    `unit`: that in which they were given; the message has the units that would make them usual.
    """
    mean = _mean(pressure)
    if not PLAUSIBLE[0] <= mean <= PLAUSIBLE[1]:
        factor = to_si(f"1 {unit}", "Pa")
        raise SceneError(
            f"{said} has a mean pressure of {mean / factor:.4g} {unit} where it touches, which is "
            f"none of a tyre; allowed: {PLAUSIBLE[0] / BAR:g} to {PLAUSIBLE[1] / BAR:g} bar"
            f"{_other_units(pressure, unit)}"
        )


def _mean(pressure: Array) -> float:
    touching = pressure[pressure > 0.0]
    return float(touching.mean()) if touching.size else float(np.nan)


def _other_units(pressure: Array, unit: str) -> str:
    given = _mean(pressure) / to_si(f"1 {unit}", "Pa")
    usual = [each for each in UNITS if USUAL[0] <= given * to_si(f"1 {each}", "Pa") <= USUAL[1]]
    if not usual:
        return ""
    return f" (are they in {' or '.join(usual)}? a heading or --pressure-unit {usual[0]} says so)"
