"""Height maps in four instrument formats that no library reads correctly."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.preprocess.roughness.height_map import HeightMap
from iceslide_fem.runtime.errors import SceneError

_METROPRO = (b"\x88\x1b\x03\x6f", b"\x88\x1b\x03\x70", b"\x88\x1b\x03\x71")
_PHASE_RESOLUTION = {0: 4096, 1: 32768, 2: 131072}  # of a fringe, by the header's phase_res
_NO_PHASE = 2147483640
_PLU_TOPOGRAPHY, _PLU_MISSING = 3, 1000001.0
_TRUEMAP = b"Binary TrueMap Data File v2.0"


def _matrix(data: bytes, kind: str, rows: int, columns: int, start: int) -> NDArray[Any]:
    """Numbers (rows, columns) from byte `start` on. Raises ValueError if truncated."""
    if start + rows * columns * np.dtype(kind).itemsize > len(data):
        raise ValueError("cut off")
    return np.frombuffer(data, kind, rows * columns, start).reshape(rows, columns)


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
        phase = _matrix(data, ">i4", rows, columns, first)
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
    """The map in a .tmd file, with lengths in mm as GelSight defines them.

    Raises SceneError.
    """
    data = path.read_bytes()
    end = data.find(b"\0", 32) + 1  # end of the comment of any length
    try:
        if not data.startswith(_TRUEMAP) or end < 33:
            raise ValueError
        columns, rows, length, width = struct.unpack_from("<2I2f", data, end)
        heights = _matrix(data, "<f4", rows, columns, end + 24)
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


def read_sensofar(path: Path) -> HeightMap:
    """The topography in a .plu file of Sensofar; heights and sides in um.

    The layout is that of Gwyddion's sensofar.c: 500 bytes, then rows, columns and heights. Raises
    SceneError.
    """
    data = path.read_bytes()
    try:
        dx, dy = struct.unpack_from("<2f", data, 404)
        (kind,) = struct.unpack_from("<I", data, 428)
        rows, columns = struct.unpack_from("<2I", data, 500)
        heights = _matrix(data, "<f4", rows, columns, 508)
    except (struct.error, ValueError):
        raise SceneError(f"{path} is not a whole .plu file of Sensofar") from None
    if kind != _PLU_TOPOGRAPHY or heights.size == 0:
        raise SceneError(f"{path} has measurements of the kind {kind}; allowed: 3, a topography")
    heights = np.where(heights == _PLU_MISSING, np.nan, 1e-6 * heights.astype(float))
    return HeightMap(heights, (1e-6 * abs(dx), 1e-6 * abs(dy)))


def read_zeta(path: Path) -> HeightMap:
    """The map in a .zmg file of KLA Zeta: unsigned whole numbers of steps, all in um.

    The layout is that of Gwyddion's zmgfile.c. Raises SceneError.
    """
    data = path.read_bytes()
    try:
        if not data.startswith(b"Zeta-Instruments"):
            raise ValueError
        columns, rows, _, dx, dy, dz = struct.unpack_from("<3I3f", data, 85)
        (remark,) = struct.unpack_from("<I", data, 117)
        heights = _matrix(data, "<u2", rows, columns, 205 + remark)
    except (struct.error, ValueError):
        raise SceneError(f"{path} is not a whole .zmg file of Zeta") from None
    if heights.size == 0:
        raise SceneError(f"{path} has no heights in it")
    return HeightMap(1e-6 * dz * heights.astype(float), (1e-6 * dx, 1e-6 * dy))
