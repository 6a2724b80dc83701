"""Meshes in XDMF (also of DOLFINx), VTU and legacy VTK, read by VTK.

A name is a nonzero cell data array of that name, or by `MeshFile.tags` a number in an array of
whole numbers, as the tags of DOLFINx are; facets are separate cells. The grids of an XDMF
file may share their points, as mesh and tags of DOLFINx do.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from iceslide_fem.mesh.named_cells import KINDS, Block, MeshFile, NamedCells, tagged_mesh
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

# By VTK's cell type, and number of nodes.
_KINDS = {(number, kind.nodes): name for name, kind in KINDS.items() for number in kind.vtk}
XINCLUDE = b"://www.w3.org/2001/XInclude"


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells that are named as `file.bodies` and all named sets of facets.

    Raises SceneError if VTK can't read the file, or as `tagged_mesh`.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = file.path.resolve()
        if source.suffix.lower() in (".xdmf", ".xmf"):
            source = _checked_xdmf(file, Path(folder))
        arrays = _by_vtk(file, source, Path(folder) / "cells.npz")
    points: dict[int, Array] = {}  # by the number of their first point
    blocks: list[Block] = []
    count = 0
    for number in range(sum(name.endswith(" types") for name in arrays)):
        own = np.asarray(arrays[f"{number} points"], dtype=float)
        same = (first for first, other in points.items() if np.array_equal(own, other))
        first = next(same, count)
        if first == count:
            points[first] = own
            count += len(own)
        blocks += _blocks(file, arrays, number, first)
    coordinates = np.concatenate([*points.values()])
    return tagged_mesh(file, NamedCells(np.arange(count), coordinates, blocks, {}))


def _blocks(file: MeshFile, arrays: Mapping[str, Any], number: int, first: int) -> list[Block]:
    """Named cells of a grid with points numbered from `first`."""
    types, offsets = arrays[f"{number} types"], arrays[f"{number} offsets"]
    nodes, sizes = arrays[f"{number} connectivity"], np.diff(offsets)
    found = []
    for title in (name for name in arrays if name.startswith(f"{number}/")):
        values, own_name = arrays[title], title.partition("/")[2]
        tagged = bool(file.tags) and np.array_equal(values, np.round(values))
        kinds = np.stack([types, sizes, values if tagged else values != 0], axis=1)
        for type_, size, value in np.unique(kinds, axis=0).astype(int).tolist():
            if not (tagged or value):
                continue
            cells = np.flatnonzero((kinds == (type_, size, value)).all(axis=1))
            table = nodes[offsets[cells][:, None] + np.arange(size)].astype(np.int64) + first
            kind = _KINDS.get((type_, size), f"VTK's type {type_}")
            dim = KINDS[kind].dim if kind in KINDS else 0
            name = _name_of(file, dim, value, own_name) if tagged else own_name
            found.append(Block(name, dim, kind, table))
    return found


def _name_of(file: MeshFile, dim: int, number: int, array: str) -> str:
    """The name that `file.tags` give to cells or facets with this number in an `array`."""
    names = (name for name, tag in file.tags if tag == number)
    named = [name for name in names if (name in file.bodies) == (dim == file.dim)]
    return named[0] if named else f"{array} {number}"


def _by_vtk(file: MeshFile, source: Path, target: Path) -> dict[str, Any]:
    """Arrays that `vtk_process` writes to the file `target`."""
    program = Path(__file__).with_name("vtk_process.py")
    words = [sys.executable, "-P", str(program), str(source), str(target)]
    done = subprocess.run(words, capture_output=True, text=True, errors="replace")
    faults = [line for line in done.stderr.splitlines() if re.search(r"ERR\||[Ee]rror", line)]
    if done.returncode == 0 and not faults:
        with np.load(target) as arrays:
            return dict(arrays)
    said = faults or done.stderr.splitlines()
    if done.returncode < 0 or not said:
        raise SceneError(f"{file} can't be read by VTK: the file is damaged")
    reason = re.sub(r"\x1b\[[0-9;]*m", "", said[0])
    reason = re.sub(r"^.*((ERR|WARN)\||: error :|\): )\s*", "", reason).strip(" .")
    raise SceneError(f"{file} can't be read by VTK: {reason}")


def _checked_xdmf(file: MeshFile, folder: Path) -> Path:
    """A copy in `folder` with links to its data files and a corrected XInclude namespace.

    DOLFINx 0.11 writes https instead of http, which crashes VTK's reader. If data lie above the
    file's folder, its own path is returned. Raises SceneError if the file is no XML, or if a data
    file is missing.
    """
    path = file.path.resolve()
    try:
        tree = ElementTree.parse(path)
    except (ElementTree.ParseError, OSError) as error:
        raise SceneError(f"{file} is no XDMF file: {error}") from None
    if tree.getroot().tag != "Xdmf":
        raise SceneError(f"{file} is no XDMF file: it begins with <{tree.getroot().tag}>")
    names = {
        (item.text or "").strip().partition(":")[0]
        for item in tree.iter("DataItem")
        if item.get("Format") == "HDF"
    }
    for name in names:
        if not (path.parent / name).is_file():
            raise SceneError(
                f"{file} keeps its data in {name}, which is not beside it; both files "
                "belong together"
            )
    if any(".." in Path(name).parts for name in names):
        return path
    for name in names:
        if not (folder / name).exists():  # exists for an absolute path
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).symlink_to(path.parent / name)
    copy = folder / path.name
    copy.write_bytes(path.read_bytes().replace(b"https" + XINCLUDE, b"http" + XINCLUDE))
    return copy
