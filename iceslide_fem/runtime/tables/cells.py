"""Cells of a table in text: how a line is split, and the numbers in its cells."""

from __future__ import annotations

import contextlib
import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple, NoReturn

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

# Words for a missing value, in lower case; stars, dashes and dots also mean one.
MISSING = {"", "nan", "-nan", "na", "n/a", "#n/a", "#nv", "null", "none", "bad", "nodata", "?"}
MISSING |= {"#num!", "#zahl!", "#div/0!", "#value!", "#wert!", "1.#qnan", "-1.#ind", "1.#ind"}
_STARS = re.compile(r"\*+|-+|\.{2,}")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]+)?")
_INFINITE = re.compile(r"([+-]?)inf(?:inity)?", re.IGNORECASE)
_LIKE_A_NUMBER = re.compile(r"[+-]?[0-9.,'’]*[0-9][0-9.,'’]*(?:[eEdD][+-]?[0-9]+)?")
_IN_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}([.,'’\s])[0-9]{3}(?:(\1[0-9]{3})+|(?!\1)[.,][0-9]*)?")
_MINUS = str.maketrans("\N{MINUS SIGN}\N{EN DASH}", "--")


class Line(NamedTuple):
    """A line of a file, and its number in it, from 1."""

    number: int
    text: str


@dataclass(frozen=True)
class TextTable:
    """Rows of cells. `said`: its name in messages.

    above: comments and lines before the heading; heading: names of the columns, () without any;
    units: of a second heading row, () without one; width: number of columns; separator: None for
    blanks; decimal: the decimal mark; ended: whether a separator ends every row.
    """

    said: str
    above: tuple[str, ...]
    heading: tuple[str, ...]
    units: tuple[str, ...]
    lines: tuple[Line, ...]
    width: int
    separator: str | None
    decimal: str
    ended: bool = False

    def rows(self) -> Iterator[list[str]]:
        """Cells of each row."""
        return (split(line.text, self.separator)[: self.width] for line in self.lines)

    def filled(self) -> TextTable:
        """The table up to its last row with a value; spreadsheets append empty rows."""
        last = len(self.lines)
        while last > 1 and not any(split(self.lines[last - 1].text, self.separator)):
            last -= 1
        return replace(self, lines=self.lines[:last])

    def numbers(self) -> Array:
        """All values, (rows, columns), NaN if missing. Raises SceneError."""
        values = np.empty((len(self.lines), self.width))
        for row, (line, cells) in enumerate(zip(self.lines, self.rows(), strict=True)):
            try:
                if self.decimal == "," or "_" in line.text:
                    raise ValueError
                values[row] = list(map(float, cells))
            except ValueError:
                values[row] = [self.number(row, i, cell) for i, cell in enumerate(cells)]
        return values

    def column(self, index: int) -> Array:
        """Values of one column, (rows,). Raises SceneError."""
        cells = (cells[index] for cells in self.rows())
        return np.array([self.number(row, index, cell) for row, cell in enumerate(cells)])

    def number(self, row: int, column: int, cell: str) -> float:
        """The value of a cell. Raises SceneError."""
        with contextlib.suppress(ValueError):
            return number(cell, self.decimal)
        reason = "is not a number"
        text = cell.strip().strip('"')
        if _IN_THOUSANDS.fullmatch(text):
            reason += ": allowed are numbers without marks between thousands"
        elif self.decimal == "," and _NUMBER.fullmatch(text):
            reason += " beside others with decimal commas"
        self.refuse(f'{self.place(row, column)}: "{text[:40]}" {reason}')

    def place(self, row: int, column: int) -> str:
        """Row and column in words, counted from 1."""
        name = self.heading[column] if column < len(self.heading) else ""
        line = self.lines[row].number
        where = f"row {row + 1}" + (f" (line {line})" if line != row + 1 else "")
        return f"{where}, column {column + 1}" + (f" ({name[:40]})" if name else "")

    def refuse(self, reason: str) -> NoReturn:
        """Raise SceneError with the name of the table."""
        raise SceneError(f"{self.said}: {reason}")


def split(line: str, separator: str | None) -> list[str]:
    """Stripped cells of a line; a quoted cell may contain the separator."""
    if separator is None:  # unlike str.split, no-break spaces do not separate
        return line.split() if line.isascii() else re.split(r"[ \t]+", line.strip(" \t"))
    cells = line.split(separator)
    if '"' in line:
        with contextlib.suppress(csv.Error):  # a cell too long for any number
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return [cell.strip() for cell in cells]


def number(cell: str, decimal: str = ".") -> float:
    """The number in a cell, NaN if it is missing. Raises ValueError otherwise."""
    text = cell.strip().strip('"').strip()
    if text.lower() in MISSING or _STARS.fullmatch(text):
        return float("nan")
    text = text.translate(_MINUS)
    if decimal == ",":
        if "." in text:
            raise ValueError
        text = text.replace(",", ".")
    if _NUMBER.fullmatch(text):
        return float(text.lower().replace("d", "e"))
    if (infinite := _INFINITE.fullmatch(text)) is not None:
        return float(f"{infinite[1]}inf")
    raise ValueError


def may_be_a_number(cell: str) -> bool:
    """Whether a cell is a number, also with thousands separators, or missing."""
    return not is_word(cell) or like_a_number(cell) is not None


def is_word(cell: str) -> bool:
    """Whether a cell is neither a number (with any decimal mark) nor missing."""
    for decimal in ".,":
        with contextlib.suppress(ValueError):
            number(cell, decimal)
            return False
    return like_a_number(cell) is None


def like_a_number(cell: str) -> str | None:
    """The text of a cell with digits and marks only, without quotes; else None."""
    text = cell.strip('"').translate(_MINUS)
    return text if _LIKE_A_NUMBER.fullmatch(text) else None
