"""Height maps from files: NumPy arrays, text, points, X3P, and vendors' formats by surfalize."""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from iceslide_fem.arrays import Array
from iceslide_fem.errors import SceneError
from iceslide_fem.files import is_regular
from iceslide_fem.roughness.surface import Surface

SQUARE = 1e-3  # relative difference of a pixel's sides
SMALLEST, LARGEST = 1e-9, 1e-2  # sides of a pixel, m
MISSING = ["***", "BAD", "bad", "Bad", "NaN", "nan", "--", "---", ""]


class _Map(NamedTuple):
    """Heights and the pixel's sides along x and y, m (None where the file does not say)."""

    heights: Array
    sides: tuple[float, float] | None


def read_surface(path: Path, pixel: float | None, height_unit: float) -> Surface:
    """A measured map as it is: tilted, perhaps with missing heights (NaN), not periodic.

    pixel: m, needed where the file does not give it; height_unit: m, of heights (and of x and y of
    points) in files that do not say. Raises SceneError with one sentence if it cannot be read.
    """
    if not is_regular(path):
        raise SceneError(f"SURFACE = {path} is not a file")
    suffix = path.suffix.lower()
    readers: dict[str, Callable[[Path, float], _Map]] = {
        ".npy": _numpy,
        ".csv": _text,
        ".txt": _text,
        ".xyz": _text,
        ".asc": _text,
        ".x3p": _x3p,
    }
    try:
        heights, sides = readers.get(suffix, _vendor)(path, height_unit)
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from None
    if np.isinf(heights).any() or not np.isfinite(heights).any():
        raise SceneError(f"{path} has heights that are infinite, or none at all")
    if sides is not None and abs(sides[0] - sides[1]) > SQUARE * abs(sides[1]):
        raise SceneError(
            f"{path} has pixels of {1e6 * sides[0]:.4g} x {1e6 * sides[1]:.4g} um; "
            "they must be square"
        )
    if sides is not None and not all(SMALLEST <= side <= LARGEST for side in sides):
        raise SceneError(
            f"{path} has pixels of {sides[0]:.4g} x {sides[1]:.4g} m; allowed: {SMALLEST:g} to "
            f"{LARGEST:g} m (--height-unit says what x and y of points are in)"
        )
    if sides is not None and pixel is not None and abs(pixel / sides[0] - 1.0) > SQUARE:
        raise SceneError(
            f"--pixel {1e6 * pixel:.4g} um contradicts {path}, whose pixels have "
            f"{1e6 * sides[0]:.4g} um; leave it out"
        )
    if sides is None and pixel is None:
        raise SceneError(f"{path} has no pixel size: give it, as in --pixel 17.5um")
    side = sides[0] if sides is not None else pixel
    assert side is not None
    return Surface(heights, side, periodic=False)


def _numpy(path: Path, unit: float) -> _Map:
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, zipfile.BadZipFile):
        raise SceneError(f"{path} is not an array that NumPy has saved") from None
    if (
        not isinstance(array, np.ndarray)
        or array.ndim != 2
        or not (np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer))
    ):
        raise SceneError(f"{path} is not a matrix of real numbers")
    return _Map(array.astype(float) * unit, None)


def _text(path: Path, unit: float) -> _Map:
    """A matrix of heights, or three columns x, y, z; by comma, semicolon, tab or blanks."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise SceneError(f"{path} is not a text file") from None
    lines = [line for line in text.splitlines() if line.strip() and line.lstrip()[0] != "#"]
    if not lines:
        raise SceneError(f"{path} has no numbers in it")
    separator = next((mark for mark in (";", "\t", ",") if mark in lines[-1]), r"\s+")
    decimal = "," if separator in (";", "\t") and "," in lines[-1] else "."
    if _is_word(re.split(separator, lines[0].strip())[0], decimal):
        del lines[0]  # names of the columns
    if not lines:
        raise SceneError(f"{path} has no numbers in it")
    try:
        table = pd.read_csv(
            io.StringIO("\n".join(lines)),
            sep=separator,
            header=None,
            na_values=MISSING,
            decimal=decimal,
            skipinitialspace=True,
        )
    except pd.errors.ParserError:
        raise SceneError(f"{path} has lines with different numbers of values") from None
    # A separator at the end of every line makes no column; one without heights within is missing.
    there = np.flatnonzero(table.notna().any())
    table = table.iloc[:, there[0] : there[-1] + 1] if there.size else table
    words = table.select_dtypes(exclude="number")
    if words.size:
        column = words.iloc[:, 0].map(str, na_action="ignore")  # true and false are words, too
        word = column[pd.to_numeric(column, errors="coerce").isna() & column.notna()].iloc[0]
        raise SceneError(f'{path}: "{word}" is not a number')
    values = table.to_numpy(dtype=float)
    if values.shape[1] == 3 and values.shape[0] > 3:
        return _points(path, values * unit)
    return _Map(values * unit, None)


def _is_word(cell: str, decimal: str) -> bool:
    """Whether `cell` is neither a number nor the mark of a missing one."""
    text = cell.strip().strip('"')
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return text not in MISSING
    return False


def _points(path: Path, points: Array) -> _Map:
    """A map from points x, y, z (m) on a regular grid; places without a point are missing."""
    if np.isnan(points[:, :2]).any():
        raise SceneError(f"{path} has points without x or y")
    columns, dx = _places(path, points[:, 0], "x")
    rows, dy = _places(path, points[:, 1], "y")
    heights = np.full((rows.max() + 1, columns.max() + 1), np.nan)
    if heights.size > 4 * len(points):
        raise SceneError(f"{path}: its points do not lie on a regular grid")
    heights[rows, columns] = points[:, 2]
    return _Map(heights, (dx, dy))


def _places(path: Path, values: Array, name: str) -> tuple[np.ndarray, float]:
    """Number of each value on a regular grid, and the grid's distance."""
    levels = np.unique(values)
    extent = levels[-1] - levels[0]
    levels = levels[np.concatenate([[True], np.diff(levels) > 1e-6 * extent])]
    if levels.size < 2:
        raise SceneError(f"{path}: all points have the same {name}")
    distance = float(np.median(np.diff(levels)))
    count = round(extent / distance)
    distance = float(extent / count)
    number = (values - levels[0]) / distance
    if np.abs(number - np.rint(number)).max() > 0.1:
        raise SceneError(f"{path}: its points do not lie on a regular grid along {name}")
    return np.rint(number).astype(int), distance


def _x3p(path: Path, unit: float) -> _Map:
    """An X3P file (ISO 5436-2, in m): a zip archive with main.xml and the heights as numbers."""
    try:
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("main.xml"))
            for element in root.iter():
                element.tag = element.tag.rpartition("}")[2]
            return _x3p_map(path, root, archive)
    except (
        zipfile.BadZipFile,
        zlib.error,
        KeyError,
        RuntimeError,
        ElementTree.ParseError,
        ValueError,
    ):
        raise SceneError(f"{path} is not an X3P file that can be read") from None


_X3P_TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


def _x3p_map(path: Path, root: ElementTree.Element, archive: zipfile.ZipFile) -> _Map:
    """Raises KeyError or ValueError where something is missing or does not fit."""

    def text(place: str) -> str:
        found = root.findtext(place)
        if found is None:
            raise KeyError(place)
        return found.strip()

    columns, rows, layers = (int(text(f"Record3/MatrixDimension/Size{axis}")) for axis in "XYZ")
    if layers != 1:
        raise SceneError(f"{path} has {layers} layers; allowed: 1")
    axes = "Record1/Axes"
    if {text(f"{axes}/CX/AxisType"), text(f"{axes}/CY/AxisType")} != {"I"}:
        raise SceneError(f"{path} has no regular grid (its axes are not incremental)")
    kind = root.findtext(f"{axes}/CZ/DataType") or "D"
    scale = float(root.findtext(f"{axes}/CZ/Increment") or 1.0) if kind in "IL" else 1.0
    link = root.findtext("Record3/DataLink/PointDataLink")
    if link is not None:
        values = np.frombuffer(archive.read(link.strip()), _X3P_TYPES[kind]).astype(float)
    else:
        datums = [datum.text or "" for datum in root.iterfind("Record3/DataList/Datum")]
        values = np.array([float(datum or "nan") for datum in datums])
    heights = values.reshape(rows, columns) * scale
    mask = root.findtext("Record3/DataLink/ValidPointsLink")
    if mask is not None:
        bits = np.unpackbits(
            np.frombuffer(archive.read(mask.strip()), np.uint8), bitorder="little"
        )[: heights.size]
        heights[bits.reshape(heights.shape) == 0] = np.nan
    sides = float(text(f"{axes}/CX/Increment")), float(text(f"{axes}/CY/Increment"))
    return _Map(heights, sides)


def _vendor(path: Path, unit: float) -> _Map:
    """Any format that surfalize knows; it is not installed with this program."""
    try:
        from surfalize import Surface as VendorSurface
        from surfalize.exceptions import (
            CorruptedFileError,
            FileFormatError,
            UnsupportedFileFormatError,
        )
    except ImportError:
        raise SceneError(
            f"{path}: read here are .npy, .csv, .txt, .xyz, .asc, .x3p and .toml; "
            "pip install surfalize reads many instruments' formats, too"
        ) from None
    try:
        found = VendorSurface.load(path)
    except (CorruptedFileError, FileFormatError, UnsupportedFileFormatError) as error:
        raise SceneError(f"{path} cannot be read by surfalize: {error}") from None
    return _Map(
        1e-6 * np.asarray(found.data, dtype=float), (1e-6 * found.step_x, 1e-6 * found.step_y)
    )
