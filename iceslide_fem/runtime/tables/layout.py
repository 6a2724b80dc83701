"""Layout of a table in text: separator, decimal mark, heading, rows.

The whole file decides, not one line. Blocks of rows below the same heading are one table, words
after the last row are left out, and a comment above the rows that has their width is the heading.
An ambiguous file is refused.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.cells import (
    MISSING,
    Line,
    TextTable,
    is_word,
    like_a_number,
    may_be_a_number,
    split,
)
from iceslide_fem.runtime.tables.grid import LARGEST_TABLE, read_text

REMARKS = ("#", "%", "//")
SEPARATORS: tuple[str | None, ...] = (";", "\t", ",", None)  # None for blanks
NO_UNIT = ("-", "\N{EN DASH}", "\N{EM DASH}")  # in a row of units
LOOKED_AT, MOST_CELLS = 400, 10_000  # sample from the whole file that decides on the separator
_EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")  # 1,234: 1234 or 1.234
_SHEET_ERROR = re.compile(r"#(?:N/A|NV|NUM|ZAHL|DIV|VALUE|WERT)\b", re.IGNORECASE)
_FOUR_DIGITS = re.compile(r"(?<![0-9.,])[0-9]{4}")
_TWO_COMMAS = re.compile(r",[0-9]*,")
# A cell of a separate row of units: rad/s, [1/s], deg C, [-].
_UNIT_BELOW = re.compile(r"[\[(]?\s*(?:1/|deg )?[^\s\d]*\S?\s*[\])]?")
_UNIT_FIRST = re.compile(r"%\s*[,;\t]")  # of a row of units that begins with percent
_NAME_AND_UNIT = re.compile(r"[^\s(\[]+(?:\s*[(\[][^)\]]*[)\]])?")


def read_table(path: Path, said: str, largest: int = LARGEST_TABLE) -> TextTable:
    """The table in the file at `path`. `said`: its name in messages, before the path.

    Raises SceneError if it cannot be read, has no numbers, has rows of different lengths, or is
    ambiguous.
    """
    return parse(read_text(path, said, largest), f"{said} {path}")


def parse(text: str, said: str) -> TextTable:
    """The table in a text; see `read_table`."""
    remarks, lines, separators = _lines(text)
    if not any(line.text.strip() for line in lines):
        raise SceneError(f"{said} has no numbers in it")
    separator = _separator(lines, separators)
    if separator != "\t":
        lines = [line for line in lines if line.text.strip()]
    usual = _usual([split(line.text, separator) for line in lines])
    starts = (i for i, line in enumerate(lines) if _is_row(line, separator, usual))
    if (start := next(starts, None)) is None:
        raise SceneError(f"{said} has no numbers in it")
    before, data = lines[:start], _one_block(lines[:start], lines[start:], separator, usual)
    _check_widths(said, [*before, *data], data[0].number, separator, usual)
    heads = [_names(line.text, separator, usual) for line in before]
    ended = _ends_in_separators(heads[-1] if heads else [], data, separator, usual)
    width = usual - ended
    heading, units, above = _heading(heads, width)
    if not heading:
        commented = [_names(remark, separator, usual) for remark in remarks]
        heading, units, _ = _heading(commented, width)
    decimal = _decimal(said, data, separator)
    said_above = (*remarks, *(line.text for line in before[:above]))
    return TextTable(
        said, said_above, heading, units, tuple(data), width, separator, decimal, bool(ended)
    )


def _is_row(line: Line, separator: str | None, usual: int) -> bool:
    """Whether a line has the usual number of cells, and values in them."""
    cells = split(line.text, separator)
    return len(cells) == usual and _begins(cells)


def _one_block(
    before: Sequence[Line], data: Sequence[Line], separator: str | None, usual: int
) -> list[Line]:
    """Rows of all blocks below the same heading, without the words between and after them."""
    headings = {line.text for line in before if len(split(line.text, separator)) >= usual}
    kept: list[Line] = []
    rows = 0  # of `kept`, up to the last row
    for line in data:
        if line.text in headings:
            del kept[rows:]
            continue
        kept.append(line)
        if _is_row(line, separator, usual):
            rows = len(kept)
    words = all(all(map(is_word, split(line.text, separator))) for line in kept[rows:])
    return kept[:rows] if words else kept


def _check_widths(
    said: str, lines: Sequence[Line], first: int, separator: str | None, usual: int
) -> None:
    """Refuse lines without the usual number of cells, but for words above the `first` row."""
    for line in lines:
        cells = split(line.text, separator)
        if len(cells) == usual or (line.number < first and any(map(is_word, cells))):
            continue
        given = f"{len(cells)} value{'s' * (len(cells) != 1)}"
        if any(map(is_word, cells)):
            given += f' ("{line.text[:40]}")'
        raise SceneError(f"{said}: line {line.number} has {given}; the others have {usual}")


def _lines(text: str) -> tuple[list[str], list[Line], Sequence[str | None]]:
    """Comments without marks, all other non-empty lines, and possible separators."""
    remarks: list[str] = []
    lines: list[Line] = []
    separators = SEPARATORS
    for number_, line in enumerate(text.rstrip("\x1a").splitlines(), start=1):
        bare = line.strip(" \N{NO-BREAK SPACE}")
        if number_ == 1 and (given := re.fullmatch(r'"?sep=(.)"?', bare)):  # of Excel
            separators = (given[1],)
        elif (
            bare.startswith(REMARKS)
            and not _SHEET_ERROR.match(bare)
            and not _UNIT_FIRST.match(bare)
        ):
            remarks.append(bare.lstrip("#%/").strip())
        elif bare:
            lines.append(Line(number_, bare))
    return remarks, lines, separators


def _separator(lines: Sequence[Line], allowed: Sequence[str | None]) -> str | None:
    """The separator with the most lines of numbers, or else the most cells of numbers.

    Lines are sampled from the whole file. The first of equal separators is taken.
    """
    if len(allowed) == 1:
        return allowed[0]
    step = len(lines) // LOOKED_AT + 1
    looked_at = [line.text for line in [*lines[::step], lines[-1]]]
    best, most = None, (-1.0, -1.0)
    for separator in allowed:
        having = [line for line in looked_at if separator is None or separator in line]
        if 2 * len(having) < len(looked_at) and lines[-1].text not in having:
            continue
        rows = [split(line, separator) for line in looked_at]
        step = sum(map(len, rows)) // MOST_CELLS + 1
        shares = [[may_be_a_number(cell) for cell in row[::step]] for row in rows]
        whole = sum(map(all, shares)) / len(shares)
        found = whole, 0.0 if whole else sum(map(sum, shares)) / sum(map(len, shares))
        if found > most:
            best, most = separator, found
    return best


def _names(line: str, separator: str | None, count: int) -> list[str]:
    """Cells of a line above the rows; with blanks, a unit in brackets belongs to its name."""
    cells = [_unquoted(cell).strip() for cell in split(line, separator)]
    if separator is None and "\t" in line and line.count("\t") == count - 1:
        return [cell.strip() for cell in line.split("\t")]
    if separator is None and len(cells) != count:
        return _NAME_AND_UNIT.findall(line)
    return cells


def _unquoted(cell: str) -> str:
    """A cell without quotes around it; one at its end is a mark, as in E"."""
    return cell.strip('"') if cell.startswith('"') else cell


def _usual(rows: Sequence[Sequence[str]]) -> int:
    """The most frequent number of cells of lines with values; for ties that of the last line."""
    counts = [len(cells) for cells in rows if _begins(cells)] or [len(cells) for cells in rows]
    often = Counter(counts)
    candidates = [count for count, times in often.items() if times == max(often.values())]
    return counts[-1] if counts[-1] in candidates else candidates[-1]


def _begins(cells: Sequence[str]) -> bool:
    """Whether a row has values: a number, or only missing values. A dash may be no unit."""
    values = [cell.strip('"') for cell in cells if not is_word(cell)]
    return any(value.lower() not in MISSING and value not in NO_UNIT for value in values) or (
        len(values) == len(cells) > 0
    )


def _ends_in_separators(
    head: Sequence[str], data: Sequence[Line], separator: str | None, width: int
) -> int:
    """1 if a separator ends every row without a further column; else 0.

    Without a heading, the last column may instead be completely missing. This is assumed if the
    first column, or the one before the last, is also missing.
    """
    if separator is None or width < 2 or any(line.text[-1] != separator for line in data):
        return 0
    if len(head) == width:
        return 1 if head[-1] == "" else 0
    if len(head) == width - 1:
        return 1
    rows = [split(line.text, separator) for line in data]
    return 0 if all(row[0] == "" for row in rows) or all(row[-2] == "" for row in rows) else 1


def _heading(
    heads: Sequence[Sequence[str]], width: int
) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Names, units of a second row, and the number of lines above."""
    fits = [len(head) in (width, width + 1) and head[width:] in ([], [""]) for head in heads]
    if not fits or not fits[-1]:
        return (), (), len(heads)
    last = tuple(heads[-1][:width])
    if len(heads) > 1 and fits[-2] and all(map(_UNIT_BELOW.fullmatch, last)):
        return tuple(heads[-2][:width]), tuple(c.strip("[]()") for c in last), len(heads) - 2
    return last, (), len(heads) - 1


def _decimal(said: str, data: Sequence[Line], separator: str | None) -> str:
    """The decimal mark of all rows. Raises SceneError if ambiguous, or with thousands marks."""
    quoted = separator == ","  # only quoted cells contain commas
    commas: set[str] = set()
    points: set[str] = set()
    whole = False  # a number of four or more digits without a mark: no thousands marks
    sure = {",": False, ".": False}  # whether a mark is certainly decimal
    for line in data:
        if "," not in line.text and (separator != ";" or sure["."] or "." not in line.text):
            whole = whole or _FOUR_DIGITS.search(line.text) is not None
            continue
        if quoted and '"' not in line.text:
            continue
        if sure[","] and "." not in line.text and not _TWO_COMMAS.search(line.text):
            continue
        for cell in split(line.text, separator):
            if (text := like_a_number(cell)) is None or text.count(".") > 1:  # no dates
                continue
            mark = "," if "," in text else "."
            if mark in text:
                (commas if mark == "," else points).add(text)
                sure[mark] = sure[mark] or not _EITHER.fullmatch(text)
            whole = whole or re.fullmatch(r"[+-]?[0-9]{4,}", text) is not None
    for text in sorted(commas | points):
        if text.count(",") > 1 or ("," in text and "." in text):
            raise SceneError(
                f'{said} has "{text}", with marks between thousands; allowed: numbers without them'
            )
    if commas:
        unclear, mark = all(map(_EITHER.fullmatch, commas)), ","
    else:
        unclear, mark = bool(points) and all(map(_EITHER.fullmatch, points)), "."
        unclear = unclear and separator == ";"
    if unclear and not whole:
        text = min(commas or points)
        raise SceneError(
            f'{said}: "{text}" could have a mark between thousands or a decimal one, '
            "and no other number tells; allowed: numbers without marks between thousands, and one "
            "that shows the decimal mark, say 0.5"
        )
    if commas and points:
        raise SceneError(
            f'{said} has decimal commas and decimal points ("{sorted(commas)[0]}", '
            f'"{sorted(points)[0]}"); allowed: one of them'
        )
    return mark
