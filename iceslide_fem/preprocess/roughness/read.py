"""Height maps from files: NumPy arrays, text, points, X3P, and instruments' formats."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from iceslide_fem.preprocess.roughness.height_map import SQUARE, HeightMap, squared, without_marks
from iceslide_fem.preprocess.roughness.instrument_binary import (
    read_metropro,
    read_sensofar,
    read_truemap,
    read_zeta,
)
from iceslide_fem.preprocess.roughness.instruments import read_by_surfalize, read_x3p
from iceslide_fem.preprocess.roughness.surface import Surface
from iceslide_fem.preprocess.roughness.text_map import read_text_map
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import is_regular

SMALLEST, LARGEST = 1e-9, 1e-2  # sides of a pixel, m
_INSTRUMENTS = {
    ".dat": read_metropro,
    ".plu": read_sensofar,
    ".tmd": read_truemap,
    ".zmg": read_zeta,
}
IN_UNITS = {".npy", ".csv", ".txt", ".xyz", ".asc", ".x3p"}  # formats with --height-unit


def read_surface(path: Path, pixel: float | None, height_unit: float | None) -> Surface:
    """A measured map without processing: tilted, with missing heights (NaN), not periodic.

    pixel: m, required if it is not in the file; height_unit: of heights (and of x and y of points,
    and of the axes of X3P) in files without a unit, m, by default metres. Raises SceneError if it
    cannot be read.
    """
    if not is_regular(path):
        raise SceneError(f"SURFACE = {path} is not a file")
    suffix = path.suffix.lower()
    if height_unit is not None and suffix not in IN_UNITS:
        raise SceneError(f"--height-unit has no meaning for {path}: its format says units itself")
    try:
        with np.errstate(all="ignore"):  # infinite values of a damaged file are reported below
            found = _read(path, suffix, height_unit)
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from None
    found = without_marks(found, str(path))
    sides = found.sides
    if sides is None:
        if pixel is None:
            raise SceneError(f"{path} has no pixel size: give it, as in --pixel 17.5um")
        return Surface(found.heights, pixel, periodic=False, notes=found.notes)
    if not all(SMALLEST <= side <= LARGEST for side in sides):
        hint = " (--height-unit says what its lengths are in)" if suffix in IN_UNITS else ""
        raise SceneError(
            f"{path} has pixels of {sides[0]:.4g} x {sides[1]:.4g} m; allowed: {SMALLEST:g} to "
            f"{LARGEST:g} m{hint}"
        )
    if pixel is not None and abs(pixel / sides[0] - 1.0) > SQUARE:
        raise SceneError(
            f"--pixel {1e6 * pixel:.4g} um contradicts {path}, whose pixels have "
            f"{1e6 * sides[0]:.4g} um; leave it out"
        )
    found = squared(found, str(path))
    assert found.sides is not None
    return Surface(found.heights, found.sides[0], False, max(sides), found.notes)


def _read(path: Path, suffix: str, unit: float | None) -> HeightMap:
    if suffix == ".npy":
        return _numpy(path, unit)
    if suffix == ".x3p":
        return read_x3p(path, unit)
    if suffix in IN_UNITS:
        return read_text_map(path, unit)
    return _INSTRUMENTS.get(suffix, read_by_surfalize)(path)


def _numpy(path: Path, unit: float | None) -> HeightMap:
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, zipfile.BadZipFile):
        raise SceneError(f"{path} is not an array that NumPy has saved") from None
    if not isinstance(array, np.ndarray) or array.ndim != 2 or array.dtype.kind not in "fiu":
        raise SceneError(f"{path} is not a matrix of real numbers")
    return HeightMap(array.astype(float) * (1.0 if unit is None else unit), None)
