"""A value that a scene gives as a number or as a table over another quantity, or in a CSV file."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from iceslide_fem.errors import SceneError
from iceslide_fem.scene.input_file import read_text
from iceslide_fem.scene.units import Quantity, to_si

MOST_ROWS = 10_000
SUFFIX = ".csv"
_HEADING = re.compile(r"\s*(.*?)\s*[\[(]\s*(.*?)\s*[\])]\s*")  # time (ms), pressure [bar]

Rows = tuple[tuple[float, float], ...]


def names_a_file(value: Any) -> bool:
    """Whether `value`, as typed, is the path of a table."""
    return isinstance(value, str) and value.strip().lower().endswith(SUFFIX)


@dataclass(frozen=True)
class RowsOf:
    """Annotation of a field that is a number (`value`) or rows of pairs [`over`, `value`], SI.

    Typed as [["0 ms", "1 bar"], ["2 ms", "3 bar"]], or as the path of a CSV file (*.csv) of two
    columns, whose header has names with units: "time (ms), pressure (bar)", or as the program's own
    tables have them, "time_s,nominal_pressure_Pa". `what` is what it is
    over; in rows the value may go down to `lowest`. A file is read when the scene is: its rows are
    then the scene's.
    """

    what: str
    over: Quantity
    value: Quantity
    lowest: str

    @property
    def _in_rows(self) -> Quantity:
        """Range of values in rows."""
        return replace(self.value, low=self.lowest)

    def rows(self, given: Any) -> Rows:
        """Rows of numbers that `given` holds, whatever their range; none of what is not right."""
        try:
            anything = replace(self.value, low=f"-1e300 {self.unit}", high=f"1e300 {self.unit}")
            found = replace(self, value=anything, lowest=anything.low).validate(given)
        except PydanticCustomError:
            return ()
        return found if isinstance(found, tuple) else ()

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return self.value.unit

    def validate(self, given: Any) -> float | Rows:
        """The number or the rows in SI; raises PydanticCustomError with one sentence."""
        if names_a_file(given):
            return self._rows(self._read(Path(given)), f" ({given})")
        if isinstance(given, list | tuple):
            return self._rows(given, "")
        return self.value.validate(given)

    def _rows(self, given: Sequence[Any], where: str) -> Rows:
        if not 2 <= len(given) <= MOST_ROWS:
            raise _fault(
                f"has {len(given)} row{'s' * (len(given) != 1)}{where}; allowed: a number, or 2 to "
                f"{MOST_ROWS} rows of {self.what} and value"
            )
        rows = []
        for number, pair in enumerate(given, start=1):
            if not isinstance(pair, list | tuple) or len(pair) != 2:
                raise _fault(
                    f"row {number}{where} is not a pair of {self.what} and value, as in "
                    f'["{self.over.low}", "{self.value.low}"]'
                )
            try:
                rows.append((self.over.validate(pair[0]), self._in_rows.validate(pair[1])))
            except PydanticCustomError as error:
                raise _fault(
                    f"row {number}{where}, {json.dumps(pair)}: {error.message()}"
                ) from None
        for number, (before, after) in enumerate(zip(rows[:-1], rows[1:], strict=True), start=1):
            if not after[0] > before[0]:
                raise _fault(f"{self.what} must rise from row {number} to row {number + 1}{where}")
        return tuple(rows)

    def _read(self, path: Path) -> list[tuple[float, float]]:
        """Rows of the file at `path`, in SI."""
        try:
            lines = [
                line
                for line in read_text(path, "the table").splitlines()
                if line.strip() and not line.startswith("#")
            ]
        except SceneError as error:
            raise _fault(f"names no table: {error}") from None
        header, *rows = list(csv.reader(lines)) or [[]]
        quantities = (self.over, self.value)
        units = [_unit(*heading) for heading in zip(header, quantities, strict=False)]
        if len(header) != 2 or not all(units):
            raise _fault(
                f"({path}) has no header of two columns with units, as in "
                f'"{self.what} ({self.over.unit}), value ({self.value.unit})"'
            )
        found = []
        for number, row in enumerate(rows, start=1):
            if len(row) != 2:
                raise _fault(f"row {number} ({path}) has {len(row)} values; allowed: 2")
            pair = []
            for text, unit, quantity in zip(row, units, quantities, strict=True):
                try:
                    pair.append(to_si(f"{float(text)!r} {unit}", quantity.unit))
                except ValueError as error:
                    raise _fault(f'row {number} ({path}): "{text} {unit}" {error}') from None
            found.append((pair[0], pair[1]))
        return found

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.validate,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: [list(row) for row in value] if isinstance(value, tuple) else value,
                when_used="json",
            ),
        )


def _unit(heading: str, quantity: Quantity) -> str | None:
    """The unit that a `heading` names: "speed (m/s)", "speed [m/s]" or "speed_m_per_s"."""
    if (bracketed := _HEADING.fullmatch(heading)) is not None:
        return str(bracketed[2])
    words = heading.strip().split("_")
    for first in range(1, len(words)):
        unit = "_".join(words[first:]).replace("_per_", "/").replace("_", "*")
        unit = {"C": "degC"}.get(unit, unit)
        try:
            to_si(f"1 {unit}", quantity.unit)
        except ValueError:
            continue
        return unit
    return None


def _fault(message: str) -> PydanticCustomError:
    return PydanticCustomError("table", "{message}", {"message": message})
