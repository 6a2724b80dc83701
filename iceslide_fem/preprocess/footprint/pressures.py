"""Pressures given as numbers: their unit, and what is plausible."""

from __future__ import annotations

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene.materials import BAR

HIGHEST = 100.0 * BAR
# Mean contact pressures of a tyre or block, Pa: plausible range, and usual range.
PLAUSIBLE = 5e3, 5e6
USUAL = 2e4, 1.5e6
UNITS = ("Pa", "kPa", "bar", "MPa", "psi", "N/cm^2")


def pressure_unit(named: list[str], option: str | None, said: str) -> str:
    """The unit of pressures: `named` in the file, else --pressure-unit, else Pa.

    Raises SceneError if they contradict each other.
    """
    factors = {_pascals(unit) for unit in named}
    if len(factors) > 1 and option is None:
        raise SceneError(f"{said} names the units {', '.join(named)}; --pressure-unit says which")
    if len(factors) == 1 and option is not None and _pascals(option) not in factors:
        raise SceneError(f"--pressure-unit {option} contradicts {said}, which is in {named[0]}")
    return option or (named[0] if named else "Pa")


def check_pressures(values: Array, said: str, unit: str) -> None:
    """Raise SceneError unless pressures (Pa) are 0 to 100 bar, with a plausible mean in contact.

    unit: of the given values; the message suggests units that make them usual.
    """
    low, high, factor = float(values.min()), float(values.max()), _pascals(unit)
    if high == 0.0 <= low:
        raise SceneError(f"{said}: no pressure is above 0, nothing is in contact")
    mean = float(values[values > 0.0].mean()) if high > 0.0 else float("nan")
    usual = [each for each in UNITS if USUAL[0] <= mean / factor * _pascals(each) <= USUAL[1]]
    hint = ""
    if usual:
        units = " or ".join(usual)
        hint = f" (are they in {units}? a heading or --pressure-unit {usual[0]} says so)"
    if low < 0.0 or high > HIGHEST:
        raise SceneError(
            f"{said} has pressures from {low / factor:.4g} to {high / factor:.4g} {unit}; allowed: "
            f"0 to {HIGHEST / factor:.4g} {unit}{hint}"
        )
    if not PLAUSIBLE[0] <= mean <= PLAUSIBLE[1]:
        raise SceneError(
            f"{said} has a mean pressure of {mean / factor:.4g} {unit} where it touches, which is "
            f"none of a tyre; allowed: {PLAUSIBLE[0] / BAR:g} to {PLAUSIBLE[1] / BAR:g} bar{hint}"
        )


def _pascals(unit: str) -> float:
    return to_si(f"1 {unit}", "Pa")
