"""A value of a scene: a number, or a table over another quantity, inline or in a CSV file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.columns import columns_of_two
from iceslide_fem.runtime.tables.layout import read_table
from iceslide_fem.scene.units import Quantity

MOST_ROWS = 10_000
SUFFIX = ".csv"

Rows = tuple[tuple[float, float], ...]


def names_a_file(value: Any) -> bool:
    """Whether `value`, as typed, is the path of a table."""
    return isinstance(value, str) and value.strip().lower().endswith(SUFFIX)


@dataclass(frozen=True)
class RowsOf:
    """Annotation of a field that is a number (`value`) or rows of pairs [`over`, `value`], SI.

    Typed as [["0 ms", "1 bar"], ["2 ms", "3 bar"]], or as the path of a CSV file (*.csv) of two
    columns. Its header has names with units, "time (ms), pressure (bar)" or
    "time_s,nominal_pressure_Pa". `what`: name of the independent quantity; `lowest`: least value in
    rows. A file is read together with the scene, and its rows become part of the scene.
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
        """Rows of numbers in `given`, without checks of range; empty if they are invalid."""
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
        for number, (before, after) in enumerate(pairwise(rows), start=1):
            if not after[0] > before[0]:
                raise _fault(f"{self.what} must rise from row {number} to row {number + 1}{where}")
        return tuple(rows)

    def _read(self, path: Path) -> list[tuple[float, float]]:
        """Rows of the file at `path`, in SI."""
        example = f'"{self.what} ({self.over.unit}), value ({self.value.unit})"'
        try:
            table = read_table(path, "the table").filled()
            over, value, places = columns_of_two(table, (self.over.unit, self.value.unit), example)
            for i in places:
                for row, number in enumerate(table.column(i)):
                    if not isfinite(number):
                        table.refuse(f"{table.place(row, i)}: no finite number")
        except SceneError as error:
            raise _fault(f"names no table: {error}") from None
        return list(zip(map(_tidy, over), map(_tidy, value), strict=True))

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


def check_falls(rows: Rows, key: str, why: str) -> None:
    """Raise ValueError with `key` and the reason if values rise with temperature."""
    for number, (colder, warmer) in enumerate(pairwise(rows), start=1):
        if warmer[1] > colder[1]:
            raise ValueError(
                f"{key} rises from row {number} to row {number + 1}: {why} that fall, or stay as "
                "they are"
            )


def _tidy(value: float) -> float:
    return float(f"{value:.15g}")  # 29 um are 2.9e-05, not 2.8999999999999998e-05


def _fault(message: str) -> PydanticCustomError:
    return PydanticCustomError("table", "{message}", {"message": message})
