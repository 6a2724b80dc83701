"""The table k, D, H_V over pressure as a file, from `iceslide roughness` or a user."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.columns import Wanted, read_columns
from iceslide_fem.scene.contact_table import ContactTable

# Column, lowest and highest value allowed (both included), SI.
COLUMNS = (
    (Wanted("pressure", "Pa", ("p", "nominal pressure")), 10.0, 1e9),
    (Wanted("k", ""), 1e-6, 1.0),
    (Wanted("D", "m"), 1e-8, 1e-2),
    (Wanted("H_V", "m"), 1e-12, 1e-2),
    (Wanted("youngs_modulus", "Pa"), 1e3, 1e11),
)
NEEDED = ("pressure", "k", "D", "H_V")


def read_contact_table(path: Path, key: str) -> ContactTable:
    """Table from a file with the columns pressure_Pa, k, D_m, H_V_m; other columns are ignored.

    The optional column youngs_modulus_Pa, constant over rows, is that of the table's rubber. Other
    units are named in the heading, as in "pressure (bar)". There are two or more rows in ascending
    pressure; lines that begin with # are comments. k must not fall and H_V must not rise with
    pressure. Otherwise raises SceneError with `key`.
    """
    wanted = [column for column, _, _ in COLUMNS]
    table, found = read_columns(path, key, wanted, NEEDED)
    for column, low, high in COLUMNS:
        if column.name not in found:
            continue
        for row, value in enumerate(found[column.name]):
            if not low <= value <= high:
                said = "is missing" if value != value else f"= {value:g} is out of range"
                raise SceneError(
                    f"{table.said}: row {row + 1} (line {table.lines[row].number}): "
                    f"{column.heading} {said}; allowed: {low:g} to {high:g}"
                )
    rows = list(zip(*(found[name].tolist() for name in NEEDED), strict=True))
    if len(rows) < 2:
        raise SceneError(f"{table.said} has {len(rows)} pressure; allowed: 2 or more")
    for number, (now, after) in enumerate(zip(rows[:-1], rows[1:], strict=True), start=1):
        for wrong, what in (
            (after[0] <= now[0], "pressure_Pa must rise from row to row"),
            (after[1] < now[1], "k must not fall when the pressure rises"),
            (after[3] > now[3], "H_V_m must not rise when the pressure rises"),
        ):
            if wrong:
                raise SceneError(f"{table.said}: rows {number} and {number + 1}: {what}")
    moduli = found.get("youngs_modulus")
    if moduli is not None and np.ptp(moduli) > 0.0:
        raise SceneError(
            f"{table.said}: youngs_modulus_Pa is {moduli.min():g} to {moduli.max():g}; allowed: "
            "the same in all rows, that of the rubber which the table is of"
        )
    pressure, k, D, H_V = zip(*rows, strict=True)
    modulus = None if moduli is None else float(moduli[0])
    return ContactTable(path.name, pressure, k, D, H_V, modulus)
