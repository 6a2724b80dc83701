"""Maps in text files: a matrix, optionally with row and column numbers."""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular
from iceslide_fem.runtime.tables.cells import MISSING, TextTable, is_word, number

LARGEST_TABLE = 10_000_000  # bytes
LARGEST_MAP = 400_000_000
ZEROS = 0.7  # fraction of zeros in every second byte, in UTF-16 without a byte order mark
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # begins like that of UTF-16
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_CONTROL = bytes(set(range(32)) - {*b"\t\n\v\f\r\x1a\x1b"})  # what no text has


def read_text(path: Path, said: str, largest: int = LARGEST_TABLE) -> str:
    """Text of the file at `path`; said: its name in messages.

    UTF-8, UTF-16 and UTF-32 are recognised by byte order marks, UTF-16 also by its zeros. Other
    text is taken as Windows-1252, the superset of Latin-1. Raises SceneError if it is not a regular
    file, is larger than `largest` bytes or is not text.
    """
    check_regular(path, said)
    try:
        if (size := path.stat().st_size) > largest:
            reason = f"it has {size / 1e6:.0f} MB; allowed: up to {largest / 1e6:.0f} MB"
        else:
            return decoded(path.read_bytes())
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError as error:  # not text, or an invalid file name
        reason = "it is not a text file"
        if "archive" in str(error):
            reason = "it is a spreadsheet or an archive; save it as CSV"
    raise SceneError(f"cannot read {said} {path}: {reason}")


def decoded(data: bytes) -> str:
    """Text of the bytes of a file. Raises ValueError if they are no text."""
    if data.startswith(b"PK\x03\x04"):
        raise ValueError("an archive is no text")
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    if encoding is None and b"\0" in data:
        begin = data[:1000]
        zeros = [begin[first::2].count(0) / max(len(begin[first::2]), 1) for first in (0, 1)]
        if max(zeros) < ZEROS:
            raise ValueError("zeros are no text")
        encoding = "utf-16-le" if zeros[1] > zeros[0] else "utf-16-be"
    if encoding is not None:
        text = data.decode(encoding)
        if "\0" in text:
            raise ValueError("zeros are no text")
        return text
    if data.translate(None, _CONTROL) != data:
        raise ValueError("control characters are no text")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        whole = data.translate(None, b"\x81\x8d\x8f\x90\x9d") == data  # what Windows-1252 has
        return data.decode("cp1252", errors="strict" if whole else "replace")


def read_matrix(path: Path, said: str) -> Array:
    """The matrix of real numbers in the .npy file at `path`; said: its name in messages.

    Raises SceneError.
    """
    try:
        values = np.load(path, allow_pickle=False)
        if (
            not isinstance(values, np.ndarray)
            or values.ndim != 2
            or values.dtype.kind not in "bfiu"
        ):
            raise ValueError
        return np.asarray(values, dtype=float)
    except OSError as error:
        raise SceneError(f"cannot read {said}: {error.strerror or error}") from None
    except (EOFError, TypeError, ValueError, BadZipFile):
        raise SceneError(f"{said} is no matrix of numbers that NumPy has saved") from None


EVEN = 1e-3  # tolerance of an even grid, over the spacing


class Grid(NamedTuple):
    """values: (rows, columns), NaN if missing; notes: sentences on what was dropped."""

    values: Array
    notes: tuple[str, ...]


def grid(table: TextTable) -> Grid:
    """The map in a table, without column names and without row and column numbers.

    A first row and column that count, or have evenly spaced positions, are not values. Raises
    SceneError if a value is not a number, or if a first row is ambiguous.
    """
    # A last column of missing values looks the same.
    notes = ["a separator ends every row, which is taken for no further column"] * table.ended
    corner = _corner(table)
    if corner is not None:
        notes.append("its first row and column hold places, which are left out")
        return Grid(corner, tuple(notes))
    if table.width > 2 and all(is_word(cells[0]) for cells in table.rows()):
        notes.append("its first column names the rows and is left out")
        return Grid(np.column_stack([table.column(i) for i in range(1, table.width)]), tuple(notes))
    values = table.numbers()
    if np.isnan(values[:, -1]).all() and table.separator is not None and not table.heading:
        notes.append("its last column is empty throughout and is taken for missing values")
    if table.heading and table.heading[0] == "" and _counts(values[:, 0]):
        values = values[:, 1:]
        notes.append("its first column numbers the rows and is left out")
    elif not table.heading and values.shape[0] > 1 and values.shape[1] > 3:
        first = list(next(table.rows()))
        if _written_whole(first) and _counts(values[0]):
            rest = values[1:]
            if any("." in line.text or "," in line.text for line in table.lines[1:]) and (
                not _all_whole(table)
            ):
                values = rest
                notes.append("its first row numbers the columns and is left out")
            elif not (np.diff(rest, axis=1) == 1.0).all():
                table.refuse(
                    f"its first row counts from {first[0]} to {first[-1]}: numbers of the columns, "
                    "or values? Remove it, or write it with decimals"
                )
    if not table.heading and values.shape[1] > 3 and values.shape[0] > 3:
        column = [cells[0] for cells in table.rows()][-len(values) :]
        if _written_whole(column) and _counts(values[:, 0]) and not _all_whole(table, skip=1):
            values = values[:, 1:]
            notes.append("its first column numbers the rows and is left out")
    return Grid(values, tuple(notes))


def is_list_of_points(table: TextTable) -> bool:
    """Whether three columns are positions x and y of a whole grid, and a value."""
    if table.width != 3 or len(table.lines) < 9:
        return False
    x, y, _ = (np.unique(column).size for column in table.numbers().T)
    return bool(min(x, y) > 1 and x * y == len(table.lines))


def _corner(table: TextTable) -> Array | None:
    """Values of a table whose first row and column are evenly spaced positions."""
    rows = enumerate(table.rows())
    first = table.heading or next(rows)[1]
    corner, *labels = first
    if len(table.lines) < 3 - bool(table.heading) or not _are_places(labels, table.decimal):
        return None
    body = np.array([[table.number(i, j, cell) for j, cell in enumerate(row)] for i, row in rows])
    places, values = body[:, 0], body[:, 1:]
    if not _even(places) or (_is_number(corner, table.decimal) and not _enough(values)):
        return None
    return values


def _are_places(cells: Sequence[str], decimal: str) -> bool:
    try:
        return _even(np.array([number(cell, decimal) for cell in cells]))
    except ValueError:
        return False


def _is_number(cell: str, decimal: str) -> bool:
    try:
        return not np.isnan(number(cell, decimal))
    except ValueError:
        return False


def _enough(values: Array) -> bool:
    """Whether there are enough positions to exclude even spacing by chance.

    If the corner has a number, the first row and column may also be values, as in a ramp.
    """
    return min(values.shape) >= 5 and not all(map(_even, values))


def _even(places: Array) -> bool:
    if places.size < 2 or not np.isfinite(places).all():
        return False
    steps = np.diff(places)
    return bool(steps[0] != 0.0 and np.abs(steps - steps[0]).max() <= EVEN * abs(steps[0]))


def _counts(values: Array) -> bool:
    """Whether values are 0, 1, 2, ... or 1, 2, 3, ..."""
    return values[0] in (0.0, 1.0) and bool((np.diff(values) == 1.0).all())


def _written_whole(cells: list[str]) -> bool:
    return all(cell.strip('"').isdigit() for cell in cells)


def _all_whole(table: TextTable, skip: int = 0) -> bool:
    """Whether all values below the first row are written without decimals, or missing."""
    cells = (cell.strip('"').lstrip("+-") for row in list(table.rows())[1:] for cell in row[skip:])
    return all(cell.isdigit() or cell.lower() in MISSING for cell in cells)
