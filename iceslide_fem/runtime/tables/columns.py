"""Columns of a table by the names in its heading, in SI units."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.layout import read_table
from iceslide_fem.runtime.units import si_unit, to_si

AGREE = 1e-4  # relative difference of columns of the same name
_IN_BRACKETS = re.compile(r"\s*(.*?)\s*(?:\(\s*([^()]*?)\s*\)|\[\s*([^\[\]]*?)\s*\]|<(.*)>)\s*")
_IN_TEXT = re.compile(
    r"[\[(]\s*([^\])]{1,12}?)\s*[\])]|_([A-Za-z0-9/^]{2,7})\b"
    r"|\b(?:in|units?|einheiten|unités|valore?|hodnot)\b[\s:=]*([^\s,;:]{1,12})",
    re.IGNORECASE,
)
_AFTER = re.compile(r"\s*(.*?)(?:\s*/\s*|\sin\s)(\S+)\s*")  # pressure / bar, pressure in bar
# Characters of names that mean the same, and those without a meaning.
_SAME = str.maketrans(
    {
        "\N{PRIME}": "'",
        "\N{ACUTE ACCENT}": "'",
        "\N{RIGHT SINGLE QUOTATION MARK}": "'",
        "`": "'",
        '"': "''",
        "\N{DOUBLE PRIME}": "''",
        "\N{RIGHT DOUBLE QUOTATION MARK}": "''",
        "δ": "delta",
    }
)
_WITHOUT_MEANING = re.compile(r"[\s_\-().]+")


class Wanted(NamedTuple):
    """A wanted column. unit: SI, "" for a pure number; other: alternative names."""

    name: str
    unit: str
    other: tuple[str, ...] = ()

    @property
    def heading(self) -> str:
        """The heading in this program's tables: pressure_Pa, temperature_C, k."""
        unit = self.unit.replace("/", "_per_").replace("*", "_")
        unit = {"K": "C"}.get(unit, unit)
        return f"{self.name}_{unit}" if unit else self.name


def has_index(table: TextTable) -> bool:
    """Whether the first column has row numbers, as pandas writes them."""
    return bool(table.heading) and table.heading[0].casefold() in ("", "unnamed: 0", "index")


def heading_unit(heading: str, unit: str) -> str | None:
    """The unit in a heading if it has the dimension of `unit` (SI, "" for none), else None.

    Forms: "speed (m/s)", "speed [m/s]", "speed / m/s", "speed in m/s", "speed_m_per_s".
    """
    return _named(heading, unit)[1]


def units_named(lines: Iterable[str], unit: str) -> list[str]:
    """Units with the dimension of `unit` in lines above a table, without duplicates.

    As in "Pressure (kPa)", "Units: kPa", "p in bar", "p_bar".
    """
    found: list[str] = []
    for match in (match for line in lines for match in _IN_TEXT.finditer(line)):
        written = next(part for part in match.groups() if part is not None)
        given = si_unit(written.rstrip("."), unit)
        if given is not None and given not in found:
            found.append(given)
    return found


def places(table: TextTable, column: Wanted) -> list[int]:
    """Indices of columns with the name of the wanted one; of several those with its unit.

    So t (s) and T (degC) are told apart.
    """
    named = [i for i, name in enumerate(table.heading) if _matches(name, column)]
    if len(named) == 1:
        return named
    return [i for i in named if column_unit(table, i, column.unit) is not None] or named


def find_columns(
    table: TextTable, wanted: Sequence[Wanted], needed: Sequence[str]
) -> dict[str, Array]:
    """Values (rows,) in SI units of the existing `wanted` columns, by name.

    Raises SceneError if a `needed` column is missing, has no unit, or is there twice with different
    values.
    """
    found: dict[str, Array] = {}
    for column in wanted:
        matches = places(table, column)
        if len(matches) > 1 and not _agree(table, matches, column):
            first = table.heading[matches[0]]
            same = len({table.heading[i] for i in matches}) == 1
            other = "twice" if same else f"twice, as {first} and {table.heading[matches[1]]}"
            table.refuse(f"has the column {column.name} {other}")
        if matches:
            found[column.name] = _in_si(table, matches[0], column)
        elif column.name in needed:
            names = ", ".join(each.heading for each in wanted if each.name in needed)
            given = ", ".join(name or '""' for name in table.heading or table.above[-1:])[:120]
            given += f", above {table.width} columns of numbers" * (not table.heading)
            table.refuse(f"has no column {column.heading}; needed: {names}; given: {given}")
    return found


def check_range(
    table: TextTable, name: str, values: Array, low: float, high: float,
    zero: float = 0.0, unit: str = "",
) -> None:  # fmt: skip
    """Refuse the first row with a missing value or one that is not from `low` to `high`.

    zero, unit: zero of the unit in which the message has values, and that unit.
    """
    for row in np.flatnonzero(~((values >= low) & (values <= high)))[:1]:
        value = values[row]
        said = "is missing" if np.isnan(value) else f"= {value - zero:g}{unit} is out of range"
        table.refuse(
            f"row {row + 1} (line {table.lines[row].number}): {name} {said}; allowed: "
            f"{low - zero:g} to {high - zero:g}{unit}"
        )


def _agree(table: TextTable, indices: Sequence[int], column: Wanted) -> bool:
    """Whether columns have the same values, as instruments repeat them."""
    first, *others = (_in_si(table, i, column) for i in indices)
    return all(np.allclose(first, other, AGREE, 0.0, equal_nan=True) for other in others)


def read_columns(
    path: Path, said: str, wanted: Sequence[Wanted], needed: Sequence[str]
) -> tuple[TextTable, dict[str, Array]]:
    """The table in a file, and its columns; see `find_columns`. Raises SceneError."""
    table = read_table(path, said).filled()
    return table, find_columns(table, wanted, needed)


def column_unit(table: TextTable, index: int, unit: str) -> str | None:
    """The unit of a column from its heading or the unit row, if it has the dimension of `unit`."""
    if index < len(table.units) and (given := table.units[index]):
        return si_unit(given, unit)
    return heading_unit(table.heading[index], unit) if index < len(table.heading) else None


def to_si_units(values: Array, given: str, unit: str) -> Array:
    """Convert `values` from the unit `given` to the SI `unit` of the same dimension."""
    zero, one = to_si(f"0 {given}", unit), to_si(f"1 {given}", unit)
    if zero == 0.0:
        return values if one == 1.0 else values * one
    return values * (to_si(f"1000 {given}", unit) - zero) / 1000.0 + zero


def _in_si(table: TextTable, index: int, column: Wanted) -> Array:
    given = column_unit(table, index, column.unit)
    # All of "tan(delta)" is a name.
    bare = index >= len(table.units) and _plain(table.heading[index]) in _names(column)
    if given is None and (column.unit or (_written_unit(table, index) and not bare)):
        _refuse_unit(table, index, column.unit, column.name, column.heading)
    values = table.column(index)
    return values if not given else to_si_units(values, given, column.unit)


def _refuse_unit(table: TextTable, index: int, unit: str, name: str, heading: str) -> NoReturn:
    """Raise SceneError for a column without a unit, or with a unit of another quantity."""
    given = _written_unit(table, index)
    said = f'has the wrong unit "{given}"' if given else "says no unit"
    table.refuse(
        f"column {index + 1} ({table.heading[index]}) {said}; allowed: {heading}, or another unit "
        f"as in {name} ({unit or '-'})"
    )


def _written_unit(table: TextTable, index: int) -> str:
    """The text in the place of the unit in or below a heading; "" without any."""
    if index < len(table.units):
        return table.units[index]
    match = _IN_BRACKETS.fullmatch(table.heading[index])
    return next((part for part in match.groups()[1:] if part), "") if match else ""


def _matches(heading: str, column: Wanted) -> bool:
    bracketed = _IN_BRACKETS.fullmatch(heading)
    given = {heading, _named(heading, column.unit)[0], bracketed[1] if bracketed else heading}
    return any(_plain(name) in _names(column) for name in given)


def _names(column: Wanted) -> set[str]:
    return {_plain(name) for name in (column.name, column.heading, *column.other)}


def _named(heading: str, unit: str) -> tuple[str, str | None]:
    """Name and unit of a heading; the unit is None without one of the dimension of `unit`."""
    for form in (_IN_BRACKETS, _AFTER):
        if (match := form.fullmatch(heading)) is not None:
            written = next((part for part in match.groups()[1:] if part is not None), "")
            if (given := si_unit(written, unit)) is not None:
                return match[1], given
    words = heading.strip().split("_")
    for first in range(1, len(words)):
        written = "_".join(words[first:]).replace("_per_", "/")
        for between in "*/":  # mPa_s and m_s
            if (given := si_unit(written.replace("_", between), unit)) is not None and written:
                return "_".join(words[:first]), given
    return heading, None


def _plain(name: str) -> str:
    """A name without case, blanks, dashes, dots and brackets, in one spelling of its marks."""
    text = name.casefold().translate(_SAME)
    return _WITHOUT_MEANING.sub("", text)


def columns_of_two(
    table: TextTable, units: tuple[str, str], example: str
) -> tuple[Array, Array, list[int]]:
    """Two columns of any name in the SI `units`, and their indices; an index column is skipped.

    Raises SceneError with the `example` of a heading.
    """
    wrong = f"has no header of two columns with units, as in {example}"
    places = list(range(table.width))
    if table.width == 3 and has_index(table):
        del places[0]
    if len(places) != 2 or not table.heading:
        raise SceneError(f"{table.said} {wrong}")
    found = []
    for i, unit in zip(places, units, strict=True):
        if (given := column_unit(table, i, unit)) is None:
            if _written_unit(table, i):
                _refuse_unit(table, i, unit, "name", f"units of {unit}")
            table.refuse(wrong)
        found.append(to_si_units(table.column(i), given, unit))
    return found[0], found[1], places
