"""Dimensions of a sweep: the values of a key, or rows of several keys that go together."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import flat, key_and_text, parsed, put, unit_of
from iceslide_fem.scene.input_file import read_text
from iceslide_fem.scene.messages import shortened
from iceslide_fem.scene.toml import set_folder
from iceslide_fem.scene.units import read_range

MOST_CASES = 100_000  # of a sweep
_RANGE = re.compile(r"[^:,]+:[^:,]+:\s*[0-9]+\s*")
_HEADING = re.compile(r"([^\s()]+)\s*(?:\(([^()]*)\))?")


class Axis(NamedTuple):
    """A dimension of a sweep.

    changes: values by dotted keys, as given, for each place along it; labels: names of the places
    of rows; none where the places are values of the key `name`.
    """

    name: str
    changes: tuple[Mapping[str, Any], ...]
    labels: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that it varies."""
        return tuple(dict.fromkeys(key for change in self.changes for key in change))


def values_of_key(key: str, values: Sequence[Any]) -> Axis:
    """The dimension of the `values` of a key."""
    return Axis(key, tuple({key: value} for value in values))


def rows_of_keys(keys: Sequence[str], rows: Sequence[Sequence[Any]]) -> Axis:
    """The dimension of `rows`, each with a value for every one of the `keys`. Raises SceneError."""
    name = ",".join(keys)
    for row in rows:
        if len(row) != len(keys):
            raise SceneError(f"{name} has the row {list(row)}; allowed: {len(keys)} values")
    return _labelled(name, [dict(zip(keys, row, strict=True)) for row in rows])


def read_axis(text: str) -> Axis:
    """The dimension of "load.pressure=1bar:5bar:5" or "load.speed=1,2,3". Raises SceneError."""
    key, values = key_and_text(text)
    unit = unit_of(key)
    if ":" not in values or (unit is None and not _RANGE.fullmatch(values)):
        return values_of_key(key, [parsed(value.strip()) for value in values.split(",")])
    if unit is None:
        raise SceneError(f"{key} is not a number: list its values, as in {key}=one,other")
    try:
        first, last, number = read_range(values)
    except ValueError as error:
        raise SceneError(f'--vary {key}="{values}" {error}') from None
    if not 2 <= number <= MOST_CASES:
        raise SceneError(f'--vary "{text}": a range has a count of 2 to {MOST_CASES}')
    even = np.linspace(_end(key, first, unit), _end(key, last, unit), number)
    return values_of_key(key, [float(f"{value:.12g}") for value in even])


def read_rows(path: Path) -> Axis:
    """The dimension of a CSV file, named after it: a column for each key, each row a place.

    A heading is a key, perhaps with the unit of its numbers, "rubber.C10 (MPa)". A column `name`
    has the labels. An empty cell leaves the scene's value. Raises SceneError.
    """
    text = read_text(path, "the table of rows")
    first = text.partition("\n")[0]
    table = [row for row in csv.reader(text.splitlines(), delimiter=_delimiter(first)) if any(row)]
    if len(table) < 2:
        raise SceneError(f"{path} has no rows below its headings")
    heads = [_heading(path, cell) for cell in table[0]]
    names, changes = [], []
    for number, row in enumerate(table[1:], start=2):
        if len(row) != len(heads):
            raise SceneError(f"row {number} of {path} has {len(row)} cells; allowed: {len(heads)}")
        tables: dict[str, Any] = {}
        for (key, unit), cell in zip(heads, map(str.strip, row), strict=True):
            if key == "name":
                names.append(cell)
            elif cell:
                value = parsed(cell)
                is_number = isinstance(value, int | float) and not isinstance(value, bool)
                put(tables, key, f"{cell} {unit}" if unit and is_number else value)
        set_folder(tables, path.parent)
        changes.append(flat(tables))
    return _labelled(path.stem, changes, names)


def _delimiter(heading: str) -> str:
    return next((letter for letter in ";\t" if letter in heading), ",")


def _heading(path: Path, cell: str) -> tuple[str, str]:
    """Key and unit ("" without one) of a heading. Raises SceneError."""
    found = _HEADING.fullmatch(cell.strip())
    if found is None:
        raise SceneError(f'{path} has the heading "{cell}"; allowed: a key, as rubber.C10 (MPa)')
    key = found[1]
    if key != "name":
        unit_of(key)
    return key, found[2] or ""


def _labelled(name: str, changes: Sequence[Mapping[str, Any]], labels: Sequence[str] = ()) -> Axis:
    """A dimension of rows; without `labels` they are known by their values."""
    labels = labels or [", ".join(map(str, change.values())) for change in changes]
    for label in labels:
        if labels.count(label) > 1:
            raise SceneError(f"{name} has the row {label} twice")
    return Axis(name, tuple(changes), tuple(labels))


def check_names(axes: Sequence[Axis], taken: Sequence[str]) -> None:
    """Raise SceneError if two dimensions have one name or key, or a name is `taken`."""
    keys = [key for axis in axes for key in axis.keys]
    for key in keys:
        if keys.count(key) > 1:
            raise SceneError(f"{key} is varied twice; give all its values in one --vary")
    if "name" in keys:
        raise SceneError("name cannot be varied: it names the sweep, not a case")
    names = [axis.name for axis in axes]
    for axis in axes:
        if names.count(axis.name) > 1 or axis.name in taken:
            raise SceneError(f"a sweep has a name {axis.name} of its own; give the rows another")


def _end(key: str, text: str, unit: str) -> float:
    """The end of a range in SI."""
    value = parsed(text)
    reason: object = "is not a number"
    try:
        if isinstance(value, str):
            return to_si(value, unit)
    except ValueError as error:
        reason = error
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
        return float(value)
    raise SceneError(f'{key} = "{shortened(text)}" {reason}')
