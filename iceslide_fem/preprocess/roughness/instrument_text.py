"""Height maps as text with the heads of instruments: Zygo's XYZ and Vision's (Wyko) ASCII files."""

from __future__ import annotations

import re

import numpy as np

from iceslide_fem.preprocess.roughness.height_map import HeightMap
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.layout import parse

_MICROMETRE = 1e-6


def read_instrument_text(text: str, said: str, unit: float | None) -> HeightMap | None:
    """The map if the head of `text` is of one of these kinds, else None. Raises SceneError."""
    first = text.lstrip("\ufeff").split("\n", 1)[0]
    if first.startswith("Zygo XYZ Data File"):
        return _zygo(text, said, unit)
    if first.startswith("Zygo ASCII Data File"):
        raise SceneError(f"{said} is a Zygo ASCII file, which is not read; .dat or XYZ files are")
    if first.startswith("Wyko ASCII Data File"):
        return _wyko(text, said, unit)
    return None


def _zygo(text: str, said: str, unit: float | None) -> HeightMap:
    """Columns and rows as whole numbers, heights in um; line 8 has the pixel, m (OMP-0347)."""
    lines = text.splitlines()
    marks = [i for i, line in enumerate(lines) if line.strip() == "#"]
    try:
        left, top, columns, rows = (int(word) for word in lines[3].split()[:4])
        pixel = float(lines[7].split()[6])
        start = marks[0] + 1
    except (IndexError, ValueError):
        raise SceneError(f"{said} has the head of a Zygo XYZ file that is not whole") from None
    if not pixel > 0.0:
        raise SceneError(f"{said} has no pixel size in its head (CameraRes is {pixel:g})")
    end = marks[1] if len(marks) > 1 else len(lines)
    body = re.sub(r"no\s*data", "NaN", "\n".join(lines[start:end]), flags=re.IGNORECASE)
    values = parse(body, said).numbers()
    if values.shape[1] != 3:
        raise SceneError(f"{said} has {values.shape[1]} columns; allowed: x, y and height")
    x, y = (values[:, :2] - (left, top)).astype(int).T
    if min(x.min(), y.min()) < 0 or x.max() >= columns or y.max() >= rows:
        raise SceneError(f"{said} has points outside the {columns} x {rows} pixels of its head")
    heights = np.full((rows, columns), np.nan)
    heights[y, x] = values[:, 2] * (_MICROMETRE if unit is None else unit)
    note = (
        ()
        if unit is not None
        else (
            "its heights are read as um, as MetroPro writes them "
            "(--height-unit is for Mx, where other units can be set)",
        )
    )
    return HeightMap(heights, (pixel, pixel), note)


def _wyko(text: str, said: str, unit: float | None) -> HeightMap:
    """Blocks of name, type, length, value; heights in waves over Mult, or in nm.

    Each line of RAW_DATA is a column of the map, from below (Gwyddion's wykofile.c).
    """
    if unit is not None:
        raise SceneError(f"--height-unit has no meaning for {said}: its format says units itself")
    lines = text.splitlines()
    head, first = {}, len(lines)
    for i, line in enumerate(lines):
        words = re.split(r"\t+", line.strip())
        if words[0].replace(" ", "_").upper() in ("RAW_DATA", "OPD"):
            first = i + 1
            break
        head[words[0]] = words[-1]
    try:
        in_nm = int(lines[0].split()[-2]) != 0
        columns, rows = int(head["X Size"]), int(head["Y Size"])
        pixel, aspect = 1e-3 * float(head["Pixel_size"]), float(head.get("Aspect", 1.0))
        factor = 1e-9 if in_nm else 1e-9 * float(head["Wavelength"]) / float(head.get("Mult", 1.0))
    except (KeyError, IndexError, ValueError, ZeroDivisionError):
        raise SceneError(f"{said} has the head of a Wyko ASCII file that is not whole") from None
    values = parse("\n".join(lines[first : first + columns]), said).numbers()
    if values.shape != (columns, rows):
        raise SceneError(
            f"{said} has {values.shape[0]} lines of {values.shape[1]} heights; its head says "
            f"{columns} of {rows}"
        )
    return HeightMap(factor * values.T[::-1], (pixel, pixel * aspect))
