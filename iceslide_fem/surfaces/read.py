"""Height maps from files: NumPy arrays, text, points and X3P, other formats by surfalize."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import is_regular
from iceslide_fem.runtime.tables.grid import read_matrix
from iceslide_fem.surfaces.height_map import SQUARE, HeightMap, squared, without_marks
from iceslide_fem.surfaces.instruments import read_x3p
from iceslide_fem.surfaces.surface import Surface
from iceslide_fem.surfaces.text_map import read_text_map

SMALLEST, LARGEST = 1e-9, 1e-2  # sides of a pixel, m
IN_UNITS = {".npy", ".csv", ".txt", ".xyz", ".asc", ".x3p"}  # read here, with --height-unit
# Formats of surfalize that tests verify with files of known size and heights.
VERIFIED = {".al3d", ".gwy", ".opd", ".os3d", ".plux", ".sdf", ".sur", ".vk3", ".vk4"}
VERIFIED |= {".vk6", ".vk7"}
# Its factor of .dat, places of .plu, signs of .zmg and unit of .tmd are wrong; on the unit of .nms
# sources contradict each other.
MISREAD = {".dat", ".nms", ".plu", ".tmd", ".zmg"}


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
        return HeightMap(read_matrix(path, str(path)) * (unit or 1.0), None)
    if suffix == ".x3p":
        return read_x3p(path, unit)
    if suffix in IN_UNITS:
        return read_text_map(path, unit)
    return _by_surfalize(path, suffix)


def _by_surfalize(path: Path, suffix: str) -> HeightMap:
    """Any format of surfalize, which is not installed with this program. Raises SceneError."""
    if suffix in MISREAD:
        raise SceneError(
            f"{path}: {suffix} files are not read, because surfalize gets their heights or units "
            "wrong; export as X3P or text"
        )
    try:
        import surfalize
        from surfalize.file.common import FileHandler
    except ImportError:
        raise SceneError(
            f"{path}: read here are .npy, .csv, .txt, .xyz, .asc, .x3p and .toml; "
            "pip install surfalize reads many instruments' formats, too"
        ) from None
    known = sorted(FileHandler.get_supported_formats_read() - MISREAD - IN_UNITS)
    if suffix not in known:
        raise SceneError(
            f'{path}: maps of "{suffix}" are not read; surfalize reads {", ".join(known)}'
        )
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            # surfalize tries all formats if that of the suffix fails, with a warning.
            warnings.filterwarnings("error", "The file suffix indicates")
            found = surfalize.Surface.load(path)
            heights = 1e-6 * np.ma.filled(np.ma.asarray(found.data, dtype=float), np.nan)
            sides = 1e-6 * float(found.step_x), 1e-6 * float(found.step_y)
    except Exception as error:  # a damaged file may raise anything
        said = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(f"{path} cannot be read by surfalize as {suffix}: {said[:200]}") from None
    if heights.ndim != 2 or heights.size == 0:
        raise SceneError(f"{path} has no map of heights in it")
    note = (
        f"unverified: no test holds what surfalize reads from {suffix} against a file of known "
        "size; compare size and rms height with those of the instrument"
    )
    return HeightMap(heights, sides, () if suffix in VERIFIED else (note,))
