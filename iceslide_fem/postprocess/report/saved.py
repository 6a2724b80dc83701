"""Pages as files: what a command has shown, kept for `iceslide report`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from iceslide_fem.postprocess.report.page import (
    Band,
    Cell,
    Chart,
    Curve,
    HeatMap,
    Page,
    Part,
    Section,
    Table,
    drawn,
    drawn_curve,
)
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import replace_file

FILE = "page.json"
KINDS: Mapping[str, type] = {kind.__name__: kind for kind in get_args(Part)}


def save_page(page: Page, folder: Path) -> None:
    """Write the page with the numbers it draws to `FILE` in the folder. Raises OutputError."""
    sections = [
        {**section._asdict(), "parts": [_written(part) for part in section.parts]}
        for section in page.sections
    ]
    replace_file(folder / FILE, json.dumps(page._asdict() | {"sections": sections}, default=float))


def read_page(folder: Path) -> Page:
    """The page that a command left in the folder. Raises SceneError if it is damaged."""
    path = folder / FILE
    try:
        found = json.loads(path.read_bytes())
        sections = [
            Section(**{**section, "parts": [_read(part) for part in section["parts"]]})
            for section in found["sections"]
        ]
        return Page(**{**found, "sections": sections})
    except (AttributeError, KeyError, OSError, RecursionError, TypeError, ValueError) as error:
        raise SceneError(f"{path} is not what a command wrote ({error})") from None


def _written(part: Part) -> dict[str, Any]:
    """A part with its kind."""
    values = part._asdict()
    if isinstance(part, Chart):
        values["curves"] = [drawn_curve(curve) for curve in part.curves]
    if isinstance(part, HeatMap):
        values["places"], values["values"] = drawn(part)
        if part.marked is not None:
            marks = np.asarray(part.marked, dtype=float)
            values["marked"] = drawn(part._replace(values=marks))[1]
    return {"part": type(part).__name__, **values}


def _read(values: dict[str, Any]) -> Part:
    kind = KINDS[values.pop("part")]
    if kind is Table:
        values["rows"] = [[Cell(*cell) for cell in row] for row in values["rows"]]
    if kind is Chart:
        values["curves"] = [Curve(**_numbers(curve)) for curve in values["curves"]]
        values["bands"] = [Band(*band) for band in values["bands"]]
    if kind is HeatMap:
        values["values"] = np.array(values["values"], dtype=float)
    part: Part = kind(**values)
    return part


def _numbers(curve: dict[str, Any]) -> dict[str, Any]:
    """A curve with NaN in place of what has no number."""
    return curve | {axis: np.array(curve[axis], dtype=float) for axis in "xy"}
