"""Height maps in instruments' own formats: two of them here, others by the library surfalize."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import numpy as np

from iceslide_fem.errors import SceneError
from iceslide_fem.roughness.height_map import HeightMap

# Formats of surfalize whose sizes and heights tests hold against files of known ones.
VERIFIED = {".al3d", ".gwy", ".opd", ".os3d", ".plu", ".plux", ".sdf", ".sur", ".vk3", ".vk4"}
VERIFIED |= {".vk6", ".vk7"}
_METROPRO = (b"\x88\x1b\x03\x6f", b"\x88\x1b\x03\x70", b"\x88\x1b\x03\x71")
_PHASE_RESOLUTION = {0: 4096, 1: 32768, 2: 131072}  # of a fringe, by the header's phase_res
_NO_PHASE = 2147483640
_TRUEMAP = b"Binary TrueMap Data File v2.0"


def read_metropro(path: Path) -> HeightMap:
    """The map in a .dat file of Zygo's MetroPro.

    Height = phase scale obliquity wavelength / resolution; the header's layout is that of the
    MetroPro Reference Guide, OMP-0347, and of Gwyddion's metropro.c. Raises SceneError.
    """
    data = path.read_bytes()
    if data[:4] not in _METROPRO:
        raise SceneError(
            f"{path} is not a .dat file of MetroPro, the one kind of .dat that is read"
        )
    try:
        (start,) = struct.unpack_from(">I", data, 6)
        width, height, buckets = struct.unpack_from(">3H", data, 52)
        columns, rows = struct.unpack_from(">2H", data, 68)
        scale, wavelength = struct.unpack_from(">2f", data, 164)
        obliquity, _, side = struct.unpack_from(">3f", data, 176)
        (resolution,) = struct.unpack_from(">h", data, 218)
        (inverted,) = struct.unpack_from(">h", data, 232)
        first = start + 2 * width * height * buckets
        phase = np.frombuffer(data, ">i4", rows * columns, first).reshape(rows, columns)
    except (struct.error, ValueError):
        raise SceneError(f"{path} is a MetroPro file that is cut off") from None
    if resolution not in _PHASE_RESOLUTION or phase.size == 0:
        raise SceneError(
            f"{path} has the phase resolution {resolution} and {columns} x {rows} heights; "
            "allowed: 0, 1 or 2, and some heights"
        )
    factor = scale * obliquity * wavelength / _PHASE_RESOLUTION[resolution]
    heights = np.where(phase >= _NO_PHASE, np.nan, phase * (-factor if inverted else factor))
    return HeightMap(heights, (float(side), float(side)))


def read_truemap(path: Path) -> HeightMap:
    """The map in a .tmd file, whose lengths are in mm as GelSight, who write them, define it.

    Raises SceneError.
    """
    data = path.read_bytes()
    end = data.find(b"\0", 32) + 1  # of the remark, which is of any length
    try:
        if not data.startswith(_TRUEMAP) or end < 33:
            raise ValueError
        columns, rows, length, width = struct.unpack_from("<2I2f", data, end)
        heights = np.frombuffer(data, "<f4", rows * columns, end + 24).reshape(rows, columns)
    except (struct.error, ValueError):
        raise SceneError(f"{path} is not a whole TrueMap file, version 2.0") from None
    if heights.size == 0:
        raise SceneError(f"{path} has no heights in it")
    note = (
        "its lengths are read as mm, which is what GelSight writes; other programs are said to "
        "write um, so compare size and rms height with those of the instrument"
    )
    return HeightMap(
        1e-3 * heights.astype(float), (1e-3 * length / columns, 1e-3 * width / rows), (note,)
    )


def read_by_surfalize(path: Path) -> HeightMap:
    """Any format that surfalize knows; it is not installed with this program. Raises SceneError."""
    try:
        import surfalize
        from surfalize.file.common import FileHandler
    except ImportError:
        raise SceneError(
            f"{path}: read here are .npy, .csv, .txt, .xyz, .asc, .x3p, .dat, .tmd and .toml; "
            "pip install surfalize reads many instruments' formats, too"
        ) from None
    suffix = path.suffix.lower()
    known = sorted(FileHandler.get_supported_formats_read() - {".xyz", ".sflz"})
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
