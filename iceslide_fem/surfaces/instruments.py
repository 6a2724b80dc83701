"""Height maps in files of instruments that are read here: X3P, and text of Zygo and Wyko."""

from __future__ import annotations

import re
import zipfile
import zlib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.layout import parse
from iceslide_fem.surfaces.height_map import HeightMap

_X3P_TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_MICROMETRE = 1e-6


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


def read_instrument_text(text: str, said: str, unit: float | None) -> HeightMap | None:
    """The map of `text` if its head is that of an instrument, else None. Raises SceneError."""
    first = text.lstrip("\ufeff").split("\n", 1)[0]
    if first.startswith("Zygo XYZ Data File"):
        return _zygo(text, said, unit)
    if first.startswith("Zygo ASCII Data File"):
        raise SceneError(f"{said} is a Zygo ASCII file, which is not read; XYZ files are")
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
