"""The table k, D, H_V over pressure as a file: what `iceslide roughness` writes, or a person."""

from __future__ import annotations

import csv
from pathlib import Path

from iceslide_fem.errors import SceneError
from iceslide_fem.materials import ContactTable
from iceslide_fem.scene.input_file import read_text

# Column, lowest and highest value allowed (both included).
COLUMNS = (
    ("pressure_Pa", 10.0, 1e9),
    ("k", 1e-6, 1.0),
    ("D_m", 1e-8, 1e-2),
    ("H_V_m", 1e-12, 1e-2),
)


def read_contact_table(path: Path, key: str) -> ContactTable:
    """Table from a CSV file with the columns pressure_Pa, k, D_m, H_V_m; more are left alone.

    Rows in ascending pressure, two or more; lines that begin with # are remarks. k must not fall
    and H_V not rise with pressure. Raises SceneError, one sentence that names `key`, otherwise.
    """
    text = read_text(path, key)
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    table = csv.DictReader(lines, skipinitialspace=True)
    try:
        heading = [name.strip() for name in table.fieldnames or []]
        table.fieldnames = heading
        entries = list(table)
    except csv.Error as error:
        raise SceneError(f"{key}: {path} is no table: {error}") from None
    missing = [name for name, _, _ in COLUMNS if name not in heading]
    if missing:
        if ";" in "".join(heading):
            raise SceneError(f"{key}: {path} has semicolons between its columns; allowed: commas")
        raise SceneError(
            f"{key}: {path} has no column {missing[0]}; needed: "
            f"{', '.join(name for name, _, _ in COLUMNS)}"
        )
    twice = next((name for name, _, _ in COLUMNS if heading.count(name) > 1), None)
    if twice is not None:
        raise SceneError(f"{key}: {path} has the column {twice} twice")
    rows = [
        tuple(_number(row[column[0]], column, number, f"{key}: {path}") for column in COLUMNS)
        for number, row in enumerate(entries, start=1)
    ]
    if len(rows) < 2:
        raise SceneError(f"{key}: {path} has {len(rows)} pressures; allowed: 2 or more")
    pressure, k, D, H_V = zip(*rows, strict=True)
    for number, (now, after) in enumerate(zip(rows[:-1], rows[1:], strict=True), start=1):
        for wrong, what in (
            (after[0] <= now[0], "pressure_Pa must rise from row to row"),
            (after[1] < now[1], "k must not fall when the pressure rises"),
            (after[3] > now[3], "H_V_m must not rise when the pressure rises"),
        ):
            if wrong:
                raise SceneError(f"{key}: {path}, rows {number} and {number + 1}: {what}")
    return ContactTable(path.name, pressure, k, D, H_V)


def _number(text: object, column: tuple[str, float, float], row: int, where: str) -> float:
    name, low, high = column
    try:
        value = float(str(text))
    except ValueError:
        raise SceneError(f'{where}, row {row}: {name} = "{text}" is not a number') from None
    if not low <= value <= high:
        raise SceneError(
            f"{where}, row {row}: {name} = {value:g} is out of range; allowed: {low:g} to {high:g}"
        )
    return value
