"""Height maps in formats of instruments that the library surfalize reads."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from iceslide_fem.preprocess.roughness.height_map import HeightMap
from iceslide_fem.runtime.errors import SceneError

# Formats of surfalize whose sizes and heights tests hold against files of known ones.
VERIFIED = {".al3d", ".gwy", ".opd", ".os3d", ".plux", ".sdf", ".sur", ".vk3", ".vk4"}
VERIFIED |= {".vk6", ".vk7"}
_OPD_BAD = 32766  # marks a missing height of 16 bits, as 32767 does (Gwyddion's wykofile.c)
# By surfalize: some are read here; of .nms the sources contradict each other on the pixel's unit.
NOT_READ = {".xyz", ".sflz", ".x3p", ".dat", ".plu", ".tmd", ".zmg", ".nms"}


def read_by_surfalize(path: Path) -> HeightMap:
    """Any format that surfalize knows; it is not installed with this program. Raises SceneError."""
    try:
        import surfalize
        from surfalize.file.common import FileHandler
    except ImportError:
        raise SceneError(
            f"{path}: read here are .npy, .csv, .txt, .xyz, .asc, .x3p, .dat, .plu, .tmd, .zmg and "
            ".toml; pip install surfalize reads many instruments' formats, too"
        ) from None
    suffix = path.suffix.lower()
    known = sorted(FileHandler.get_supported_formats_read() - NOT_READ)
    if suffix not in known:
        raise SceneError(
            f'{path}: maps of "{suffix}" are not read; surfalize reads {", ".join(known)}'
        )
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            # It goes through all formats if that of the suffix fails, and says so in a warning.
            warnings.filterwarnings("error", "The file suffix indicates")
            found = surfalize.Surface.load(path)
            heights = 1e-6 * np.ma.filled(np.ma.asarray(found.data, dtype=float), np.nan)
            if suffix == ".opd":
                wave = 1e-6 * found.metadata["Wavelength"] / found.metadata["Mult"]
                heights[np.abs(heights) > (_OPD_BAD - 0.5) * abs(wave)] = np.nan
            sides = 1e-6 * float(found.step_x), 1e-6 * float(found.step_y)
    except Exception as error:  # whatever a damaged file makes of a library
        said = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(f"{path} cannot be read by surfalize as {suffix}: {said[:200]}") from None
    if heights.ndim != 2 or heights.size == 0:
        raise SceneError(f"{path} has no map of heights in it")
    if suffix in VERIFIED:
        return HeightMap(heights, sides)
    note = (
        f"unverified: no test holds what surfalize reads from {suffix} against a file of known "
        "size; compare size and rms height with those of the instrument"
    )
    return HeightMap(heights, sides, (note,))
