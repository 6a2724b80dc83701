"""Pressures given as numbers: unit, plausibility, and frames of a pressure mat.

Frames are read from the text export of Tekscan's programs (ASF, CSV).
"""

from __future__ import annotations

import re

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.layout import parse
from iceslide_fem.runtime.units import si_unit, to_si
from iceslide_fem.scene.materials import BAR

HIGHEST = 100.0 * BAR
# Mean contact pressures of a tyre or block, Pa: plausible range, and usual range.
PLAUSIBLE = 5e3, 5e6
USUAL = 2e4, 1.5e6
UNITS = ("Pa", "kPa", "bar", "MPa", "psi", "N/cm^2")
_FRAME = re.compile(r"^Frame[ \t,;]+([0-9]+).*$", re.MULTILINE | re.IGNORECASE)
_EMPTY = re.compile(r"^[,; \t]+$", re.MULTILINE)  # lines padded by a spreadsheet
_BLANK = re.compile(r"(?<![^,;\t\n ])[Bb](?![^,;\t\n ])")  # a position without a sensor


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


def is_sensor_text(text: str) -> bool:
    """Whether a text is an export of frames (its head begins with DATA_TYPE)."""
    return text.lstrip('\ufeff \t\r\n"').startswith("DATA_TYPE")


def read_frame(text: str, said: str, number: int | None) -> tuple[Array, tuple[float, float], str]:
    """Pressures of the frame `number`, by default of the frame with the largest force.

    Returns pressures (rows, columns), Pa, first row on top, NaN without a sensor; length and width,
    m; a sentence on the frame. Raises SceneError.
    """
    text = text.replace("\r\n", "\n")
    marks = list(_FRAME.finditer(text))
    if not marks:
        raise SceneError(f"{said} has no line Frame 1, nor another frame")
    head = _head(text[: marks[0].start()])
    rows, columns = (_whole(head, key, said) for key in ("ROWS", "COLS"))
    dy, dx = (_length(head, f"{key}_SPACING", said) for key in ("ROW", "COL"))
    factor, unit = _factor(head, dx * dy, said)
    frames: dict[int, Array] = {}
    for mark, end in zip(marks, [*(m.start() for m in marks[1:]), len(text)], strict=True):
        body = _EMPTY.sub("", text[mark.end() : end].replace("@@", ""))
        values = parse(_BLANK.sub("NaN", body), f"{said}, frame {mark[1]}").numbers()
        if values.shape != (rows, columns):
            raise SceneError(
                f"{said}: frame {mark[1]} has {values.shape[0]} rows of {values.shape[1]}; its "
                f"head says {rows} of {columns}"
            )
        frames[int(mark[1])] = values * factor
    largest = ""
    if number is None:
        number = max(frames, key=lambda n: float(np.nansum(frames[n])))
        largest = ", that of the largest force" if len(frames) > 1 else ""
    if number not in frames:
        raise SceneError(
            f"--frame {number} is not in {said}, which has the frames {min(frames)} to "
            f"{max(frames)}"
        )
    note = (
        f"frame {number} of {len(frames)} is read{largest}, in {unit}, with sensors "
        f"{1e3 * dx:.4g} x {1e3 * dy:.4g} mm apart; its columns run along the direction of travel"
    )
    return frames[number], (columns * dx, rows * dy), note


def _head(text: str) -> dict[str, str]:
    lines = [re.split(r"[ \t,;:=]+", line.strip(' \t,;"'), maxsplit=1) for line in text.split("\n")]
    return {line[0].upper(): line[1].strip(' \t,;"') for line in lines if len(line) == 2}


def _whole(head: dict[str, str], key: str, said: str) -> int:
    given = head.get(key, "")
    if not given.isdigit() or int(given) < 1:
        raise SceneError(f'{said} has {key} "{given}" in its head; allowed: a whole number')
    return int(given)


def _length(head: dict[str, str], key: str, said: str) -> float:
    given = head.get(key, "").replace(",", ".")
    try:
        length = to_si(given, "m")
    except ValueError:
        raise SceneError(f'{said} has {key} "{given}" in its head; allowed: say "2.0 mm"') from None
    if not 1e-5 <= length <= 0.1:
        raise SceneError(f"{said} has {key} {given} in its head; allowed: 0.01 to 100 mm")
    return length


def _factor(head: dict[str, str], area: float, said: str) -> tuple[float, str]:
    """Factor from values to Pa, and their unit; forces act on the area (m2) of a sensor."""
    given = head.get("UNITS", "")
    if (unit := si_unit(given, "Pa")) is not None:
        return to_si(f"1 {unit}", "Pa"), unit
    if (unit := si_unit(given, "N")) is not None:
        return to_si(f"1 {unit}", "N") / area, f"{unit} per sensor"
    raise SceneError(
        f'{said} has UNITS "{given}" in its head; allowed: a pressure such as kPa, or a force: '
        "raw counts are no pressures"
    )
