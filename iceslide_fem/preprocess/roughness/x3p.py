"""Height maps in X3P files (ISO 5436-2, ISO 25178-72): an archive of XML and binary heights."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from iceslide_fem.preprocess.roughness.height_map import HeightMap
from iceslide_fem.runtime.errors import SceneError

TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


def read_x3p(path: Path, unit: float | None) -> HeightMap:
    """The map in an X3P file, whose members may be in a folder of the archive.

    unit: m, of files whose axes are not in metres as the standard has it. Raises SceneError.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name.replace("\\", "/"): name for name in archive.namelist()}
            main = next(
                (name for name in members if name.rpartition("/")[2].lower() == "main.xml"), None
            )
            if main is None:
                raise SceneError(f"{path} is not an X3P file: it has no main.xml")
            folder = main[: -len("main.xml")]
            root = ElementTree.fromstring(archive.read(members[main]))
            for element in root.iter():
                element.tag = element.tag.rpartition("}")[2]

            def member(link: str) -> bytes:
                name = link.strip().replace("\\", "/").lstrip("./")
                return archive.read(members.get(folder + name) or members[name])

            binary = {
                key: member(link)
                for key in ("PointDataLink", "ValidPointsLink")
                if (link := root.findtext(f"Record3/DataLink/{key}") or "").strip()
            }
    except (
        zipfile.BadZipFile,
        zlib.error,
        KeyError,
        NotImplementedError,
        RuntimeError,
        EOFError,
        ElementTree.ParseError,
        ValueError,
    ):
        raise SceneError(f"{path} is not an X3P file that can be read") from None
    try:
        found = _map(path, root, binary)
    except (KeyError, ValueError) as error:
        said = f"its {error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise SceneError(f"{path} is not an X3P file that can be read: {said}") from None
    if unit is None:
        return found
    x, y = found.sides or (1.0, 1.0)
    note = f"its axes are taken to be in units of {unit:g} m (--height-unit)"
    return HeightMap(found.heights * unit, (x * unit, y * unit), (note,))


def _map(path: Path, root: ElementTree.Element, binary: dict[str, bytes]) -> HeightMap:
    """Raises KeyError or ValueError where something is missing or does not fit."""

    def text(place: str) -> str:
        found = root.findtext(place)
        if found is None or not found.strip():
            raise KeyError(place.rpartition("/")[2])
        return found.strip()

    columns, rows, layers = (int(text(f"Record3/MatrixDimension/Size{axis}")) for axis in "XYZ")
    if layers != 1:
        raise SceneError(f"{path} has {layers} layers; allowed: 1")
    axes = "Record1/Axes"
    if {text(f"{axes}/CX/AxisType"), text(f"{axes}/CY/AxisType")} != {"I"}:
        raise SceneError(f"{path} has no regular grid (its axes are not incremental)")
    kind = (root.findtext(f"{axes}/CZ/DataType") or "D").strip()
    scale = float(root.findtext(f"{axes}/CZ/Increment") or 1.0) if kind in "IL" else 1.0
    if "PointDataLink" in binary:
        values = np.frombuffer(binary["PointDataLink"], TYPES[kind]).astype(float)
    else:
        datums = [datum.text or "" for datum in root.iterfind("Record3/DataList/Datum")]
        values = np.array([float(datum.rpartition(";")[2] or "nan") for datum in datums])
    if values.size != rows * columns:
        raise ValueError(f"it has {values.size} heights; its head says {rows} rows of {columns}")
    heights = values.reshape(rows, columns) * scale
    if "ValidPointsLink" in binary:
        bits = np.unpackbits(np.frombuffer(binary["ValidPointsLink"], np.uint8), bitorder="little")[
            : heights.size
        ]
        if bits.size < heights.size:
            raise ValueError("its list of valid points is too short")
        heights[bits.reshape(heights.shape) == 0] = np.nan
    sides = float(text(f"{axes}/CX/Increment")), float(text(f"{axes}/CY/Increment"))
    return HeightMap(heights, sides)
