"""Frames of a pressure mat: text exports of Tekscan (ASF, CSV), XSENSOR and programs like them.

A head of names and values is followed by frames, each below a line "Frame 1". Lines of words
between the rows of numbers are the head of their frame.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.point_list import GivenMap
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.cells import is_word
from iceslide_fem.runtime.tables.grid import grid
from iceslide_fem.runtime.tables.layout import parse
from iceslide_fem.runtime.units import si_unit, to_si
from iceslide_fem.scene.materials import BAR

# Fractions of the pixels in contact that are said: where the file says the end, and elsewhere.
FEW, MANY = 0.01, 0.1
NEARLY_ALL = 0.9  # a map of these says where there is contact, not how hard
ROUNDING = 1e-3  # of pressures given as numbers
OF_COLOURS = 0.01  # of the scale of a picture
WITH_LOAD = 0.05  # largest error of mu at a given load (scripts.studies.poor_maps)


def saturation(
    pressure: Array, said: str, end: float | None, of_colours: bool, loaded: bool
) -> tuple[str, ...]:
    """A note on pixels at the `end` (Pa) of the scale of a sensor or picture; () if there is none.

    pressure: as read, Pa; said: the source in messages; end: None for pressures whose file has
    none, then it is the largest one, unless all are the same; loaded: whether the load is given.
    Raises SceneError without it if nearly all pixels in contact are at the end.
    """
    touching = pressure[pressure > 0.0]
    top = float(touching.max()) if end is None else end
    tolerance = OF_COLOURS if of_colours else ROUNDING if end is not None else 0.0
    fraction = float((touching >= (1.0 - tolerance) * top).mean())
    stated = end is not None and not of_colours
    alike = not stated and np.ptp(touching) <= tolerance * top
    if alike or fraction < (FEW if stated else MANY):
        return ()
    where = "the end of its colour scale" if of_colours else "its largest pressure"
    if stated:
        where = "the pressure at which its sensors saturate"
    found = f"{said} has {fraction:.0%} of the pixels in contact at {where}, {top / BAR:.4g} bar"
    if loaded:
        return (f"{found}: if the pressure is higher there, mu is off by up to {WITH_LOAD:.0%}",)
    if fraction > NEARLY_ALL:
        raise SceneError(
            f"{found}: it says where the tyre touches, and not how hard; --load says "
            "what it carries"
        )
    return (
        f"{found}: if the pressure is higher there, the load is too low, and mu too high by the "
        'same factor, 1.1 to 1.9 with half of the pixels cut (page "Footprints"); with '
        f"the true --load mu is within {WITH_LOAD:.0%}",
    )


_FRAME = re.compile(
    r'^"?Frame(?: ?(?:Number|No\.?|#))?["\s,;:=#]+([0-9]+).*$', re.MULTILINE | re.IGNORECASE
)
_BLANK = re.compile(r"(?<![^,;\t\n ])[Bb](?![^,;\t\n ])")  # a position without a sensor
_FIRST = re.compile(r'["\s]*([^,;\t "]*)')
_QUANTITY = re.compile(r'([0-9]+(?:[.,][0-9]+)?)[\s,;"]*([^\s,;"]*)')
# Names in a head, of Tekscan and of XSENSOR.
_NAMES = {
    "rows": "(?:number of )?rows",
    "columns": "(?:number of )?col(?:umn)?s",
    "dy": "(?:row[_ ]spacing|sensel height|sensor height)",
    "dx": "(?:col(?:umn)?[_ ]spacing|sensel width|sensor width)",
    "units": "(?:pressure[_ ])?units?",
    "mean": "(?:average|mean|peak|max(?:imum)?)[_ ]pressure",  # whose unit is that of the values
    "saturation": "saturation[_ ]pressure",
}
_LINES = {
    key: re.compile(
        rf'^["\s]*(?P<name>{names})\s*(?:[\[(](?P<unit>[^\])]*)[\])])?[\s:=,;"]+(?P<value>.*)$',
        re.MULTILINE | re.IGNORECASE,
    )
    for key, names in _NAMES.items()
}


class _Entry(NamedTuple):
    """A line of a head: its name, the unit beside the name, and the text behind it."""

    name: str
    unit: str
    value: str


def is_sensor_text(text: str) -> bool:
    """Whether a text is an export of frames: it has one, or its head begins with DATA_TYPE."""
    return text.lstrip('\ufeff \t\r\n"').startswith("DATA_TYPE") or bool(_FRAME.search(text))


def read_frame(text: str, said: str, number: int | None) -> GivenMap:
    """The frame `number`, by default the one with the largest force. Raises SceneError.

    Values are in Pa if the head names their unit, else as they are in the file.
    """
    text = text.replace("\r\n", "\n")
    marks = list(_FRAME.finditer(text))
    if not marks:
        raise SceneError(f"{said} has no line Frame 1, nor another frame")
    ends = [*(mark.start() for mark in marks[1:]), len(text)]
    head = _head(text[: ends[0]])
    shape = tuple(_whole(head[key], said) for key in ("rows", "columns") if key in head)
    sides = [_length(head[key], said) for key in ("dx", "dy") if key in head]
    dx, dy = sides if len(sides) == 2 else (None, None)
    factor, unit = _factor(head, dx and dy and dx * dy, said)
    frames: dict[int, Array] = {}
    for mark, end in zip(marks, ends, strict=True):
        frame = int(mark[1])
        values = _rows(text[mark.end() : end], f"{said}, frame {frame}", shape)
        expected = shape if len(shape) == 2 else next(iter(frames.values()), values).shape
        if values.shape != expected:
            raise SceneError(
                f"{said}: frame {frame} has {values.shape[0]} rows of {values.shape[1]}; its "
                f"head says {expected[0]} of {expected[1]}"
            )
        frames[frame] = values * factor
    largest = ""
    if number is None:
        number = max(frames, key=lambda n: float(np.nansum(frames[n])))
        largest = ", that of the largest force" if len(frames) > 1 else ""
    if number not in frames:
        raise SceneError(
            f"--frame {number} is not in {said}, which has the frames {min(frames)} to "
            f"{max(frames)}"
        )
    rows, columns = frames[number].shape
    size = None if dx is None or dy is None else (columns * dx, rows * dy)
    apart = "" if not dx or not dy else f", with sensors {1e3 * dx:.4g} x {1e3 * dy:.4g} mm apart"
    note = (
        f"frame {number} of {len(frames)} is read{largest}{f', in {unit}' * bool(unit)}{apart}; "
        "its columns run along the direction of travel"
    )
    units = () if unit is None else ("Pa",)
    return GivenMap(frames[number], units, size, (note,), _saturation(head))


def _rows(body: str, said: str, shape: tuple[int, ...]) -> Array:
    """Numbers of a frame; lines that begin with a word, or are empty, are none of its rows."""
    kept = []
    for line in _BLANK.sub("NaN", body.replace("@@", "")).split("\n"):
        first = _FIRST.match(line)
        words = first is not None and is_word(first[1])
        kept.append("" if words or not line.strip(' \t,;"') else line)
    table = parse("\n".join(kept), said)
    values = table.numbers()
    return values if values.shape == shape else grid(table).values


def _head(text: str) -> dict[str, _Entry]:
    found = {}
    for key, line in _LINES.items():
        if (match := line.search(text)) is not None:
            value = match["value"].strip(' \t,;"')
            found[key] = _Entry(match["name"], match["unit"] or "", value)
    return found


def _whole(entry: _Entry, said: str) -> int:
    if not entry.value.isdigit() or int(entry.value) < 1:
        raise SceneError(
            f'{said} has {entry.name} "{entry.value}" in its head; allowed: a whole number'
        )
    return int(entry.value)


def _si(entry: _Entry, unit: str) -> float | None:
    """The quantity of an entry in the SI `unit`, None without a unit of its dimension."""
    match = _QUANTITY.fullmatch(entry.value)
    given = match and si_unit(match[2] or entry.unit, unit)
    return to_si(f"{match[1].replace(',', '.')} {given}", unit) if match and given else None


def _length(entry: _Entry, said: str) -> float:
    if (length := _si(entry, "m")) is None:
        raise SceneError(
            f'{said} has {entry.name} "{entry.value}" in its head; allowed: say "2.0 mm"'
        )
    if not 1e-5 <= length <= 0.1:
        raise SceneError(
            f"{said} has {entry.name} {entry.value} in its head; allowed: 0.01 to 100 mm"
        )
    return length


def _saturation(head: dict[str, _Entry]) -> float | None:
    return _si(head["saturation"], "Pa") if "saturation" in head else None


def _factor(head: dict[str, _Entry], area: float | None, said: str) -> tuple[float, str | None]:
    """Factor from values to Pa, and their unit; 1 and None if the head has none.

    Forces act on the area (m2) of a sensor. Raises SceneError.
    """
    if "units" in head:
        given = head["units"].value
    elif "mean" in head and head["mean"].unit:
        given = head["mean"].unit
    else:
        return 1.0, None
    if (unit := si_unit(given, "Pa")) is not None:
        return to_si(f"1 {unit}", "Pa"), unit
    if (unit := si_unit(given, "N")) is not None and area:
        return to_si(f"1 {unit}", "N") / area, f"{unit} per sensor"
    raise SceneError(
        f'{said} has UNITS "{given}" in its head; allowed: a pressure such as kPa, or a force and '
        "the spacing of the sensors: raw counts are no pressures"
    )
