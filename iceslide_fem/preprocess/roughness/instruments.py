"""Height maps in files of instruments: X3P read here, others by surfalize."""

from __future__ import annotations

import warnings
import zipfile
import zlib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from iceslide_fem.preprocess.roughness.height_map import HeightMap
from iceslide_fem.runtime.errors import SceneError

_X3P_TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
# Formats of surfalize that tests verify with files of known size and heights.
VERIFIED = {".al3d", ".gwy", ".opd", ".os3d", ".plux", ".sdf", ".sur", ".vk3", ".vk4"}
VERIFIED |= {".vk6", ".vk7"}
_OPD_BAD = 32766  # a missing 16-bit height, as is 32767 (Gwyddion's wykofile.c)
# Formats not left to surfalize: read here, or read wrongly by it. For .nms and .tmd the sources
# contradict each other on the unit.
NOT_READ = {".xyz", ".sflz", ".x3p", ".dat", ".plu", ".tmd", ".zmg", ".nms"}


def read_x3p(path: Path, unit: float | None) -> HeightMap:
    """The map in an X3P file (ISO 5436-2, ISO 25178-72): an archive of XML and binary heights.

    Its members may be in a folder of the archive. unit: of axes not in metres (as the standard
    requires), m. Raises SceneError.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name.replace("\\", "/"): name for name in archive.namelist()}
            mains = [name for name in members if name.rpartition("/")[2].lower() == "main.xml"]
            if not mains:
                raise SceneError(f"{path} is not an X3P file: it has no main.xml")
            folder = mains[0][: -len("main.xml")]
            root = ElementTree.fromstring(archive.read(members[mains[0]]))
            for element in root.iter():
                element.tag = element.tag.rpartition("}")[2]
            binary = {}
            for key in ("PointDataLink", "ValidPointsLink"):
                link = (root.findtext(f"Record3/DataLink/{key}") or "").strip()
                if name := link.replace("\\", "/").lstrip("./"):
                    binary[key] = archive.read(members.get(folder + name) or members[name])
    except (
        zipfile.BadZipFile, zlib.error, KeyError, NotImplementedError, RuntimeError, EOFError,
        ElementTree.ParseError, ValueError,
    ):  # fmt: skip
        raise SceneError(f"{path} is not an X3P file that can be read") from None
    try:
        heights, (dx, dy) = _x3p_map(path, root, binary)
    except (KeyError, ValueError) as error:
        said = f"its {error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise SceneError(f"{path} is not an X3P file that can be read: {said}") from None
    if unit is None:
        return HeightMap(heights, (dx, dy))
    note = f"its axes are taken to be in units of {unit:g} m (--height-unit)"
    return HeightMap(heights * unit, (dx * unit, dy * unit), (note,))


def _x3p_map(
    path: Path, root: ElementTree.Element, binary: dict[str, bytes]
) -> tuple[np.ndarray, tuple[float, float]]:
    """Heights and sides of a pixel. Raises KeyError or ValueError for missing or invalid parts."""

    def text(place: str) -> str:
        if not (found := (root.findtext(place) or "").strip()):
            raise KeyError(place.rpartition("/")[2])
        return found

    columns, rows, layers = (int(text(f"Record3/MatrixDimension/Size{axis}")) for axis in "XYZ")
    if layers != 1:
        raise SceneError(f"{path} has {layers} layers; allowed: 1")
    axes = "Record1/Axes"
    if {text(f"{axes}/CX/AxisType"), text(f"{axes}/CY/AxisType")} != {"I"}:
        raise SceneError(f"{path} has no regular grid (its axes are not incremental)")
    kind = (root.findtext(f"{axes}/CZ/DataType") or "D").strip()
    scale = float(root.findtext(f"{axes}/CZ/Increment") or 1.0) if kind in "IL" else 1.0
    if "PointDataLink" in binary:
        values = np.frombuffer(binary["PointDataLink"], _X3P_TYPES[kind]).astype(float)
    else:
        datums = [datum.text or "" for datum in root.iterfind("Record3/DataList/Datum")]
        values = np.array([float(datum.rpartition(";")[2] or "nan") for datum in datums])
    if values.size != rows * columns:
        raise ValueError(f"it has {values.size} heights; its head says {rows} rows of {columns}")
    if "ValidPointsLink" in binary:
        bits = np.unpackbits(np.frombuffer(binary["ValidPointsLink"], np.uint8), bitorder="little")
        if bits.size < values.size:
            raise ValueError("its list of valid points is too short")
        values[bits[: values.size] == 0] = np.nan
    sides = float(text(f"{axes}/CX/Increment")), float(text(f"{axes}/CY/Increment"))
    return values.reshape(rows, columns) * scale, sides


def read_by_surfalize(path: Path) -> HeightMap:
    """Any format of surfalize, which is not installed with this program. Raises SceneError."""
    try:
        import surfalize
        from surfalize.file.common import FileHandler
    except ImportError:
        raise SceneError(
            f"{path}: read here are .npy, .csv, .txt, .xyz, .asc, .x3p, .dat and .toml; "
            "pip install surfalize reads many instruments' formats, too"
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
            # surfalize tries all formats if that of the suffix fails, with a warning.
            warnings.filterwarnings("error", "The file suffix indicates")
            found = surfalize.Surface.load(path)
            heights = 1e-6 * np.ma.filled(np.ma.asarray(found.data, dtype=float), np.nan)
            if suffix == ".opd":
                wave = 1e-6 * found.metadata["Wavelength"] / found.metadata["Mult"]
                heights[np.abs(heights) > (_OPD_BAD - 0.5) * abs(wave)] = np.nan
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
