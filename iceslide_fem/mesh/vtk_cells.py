"""Meshes that ParaView shows: XDMF (of DOLFINx, too), VTU and legacy VTK, read by VTK.

A name is cell data of that name that are not zero; facets are cells of their own. The grids of an
XDMF file may share their points, as the mesh and the tags of DOLFINx do.
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
from numpy.typing import NDArray

from iceslide_fem.mesh.mesh_file import MeshFile
from iceslide_fem.mesh.named_cells import Block, NamedCells, tagged_mesh
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.errors import SceneError

Floats = NDArray[np.float64]

# VTK's numbers of cell types, and how many nodes their kind has here: dimension and kind.
_KINDS = {
    (3, 2): (1, "line"),
    (4, 2): (1, "line"),  # what XDMF calls a polyline
    (5, 3): (2, "triangle"),
    (9, 4): (2, "quadrilateral"),
    (10, 4): (3, "tetrahedron"),
    (12, 8): (3, "hexahedron"),
    (13, 6): (3, "wedge"),
    (14, 5): (3, "pyramid"),
    (21, 3): (1, "line3"),
    (22, 6): (2, "triangle6"),
    (34, 7): (2, "triangle7"),
    (23, 8): (2, "quadrilateral8"),
    (28, 9): (2, "quadrilateral9"),
    (24, 10): (3, "tetrahedron10"),
    (25, 20): (3, "hexahedron20"),
    (29, 27): (3, "hexahedron27"),
    (68, 3): (1, "line3"),  # Lagrange cells of second order
    (69, 6): (2, "triangle6"),
    (70, 9): (2, "quadrilateral9"),
    (71, 10): (3, "tetrahedron10"),
    (72, 27): (3, "hexahedron27"),
}
XINCLUDE = "://www.w3.org/2001/XInclude"
XINCLUDE_HTTP = f"http{XINCLUDE}".encode()


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells that are named as `file.bodies` and all named sets of facets.

    Raises SceneError where VTK can't read the file, and as `tagged_mesh` does.
    """
    if file.path.suffix.lower() in (".xdmf", ".xmf"):
        _check_xdmf(file)
    arrays = _by_vtk(file)
    points: list[Floats] = []
    firsts: list[int] = []
    blocks: list[Block] = []
    count = 0
    for number in range(sum(name.endswith(" types") for name in arrays)):
        own = np.asarray(arrays[f"{number} points"], dtype=float)
        same = [first for first, other in zip(firsts, points, strict=True) if _equal(own, other)]
        first = same[0] if same else count
        if not same:
            points.append(own)
            firsts.append(first)
            count += len(own)
        blocks += _blocks(arrays, number, first)
    found = NamedCells(np.arange(count), np.concatenate(points), blocks, {})
    return tagged_mesh(file, found)


def _equal(one: Floats, other: Floats) -> bool:
    return one.shape == other.shape and np.array_equal(one, other)


def _blocks(arrays: Mapping[str, Any], number: int, first: int) -> list[Block]:
    """Named cells of a grid whose points are numbered from `first`."""
    types, offsets = arrays[f"{number} types"], arrays[f"{number} offsets"]
    nodes = arrays[f"{number} connectivity"]
    sizes = np.diff(offsets)
    found = []
    for name in arrays:
        if not name.startswith(f"{number}/"):
            continue
        marked = np.asarray(arrays[name] != 0)
        for kind, size in np.unique(np.stack([types[marked], sizes[marked]], axis=1), axis=0):
            cells = np.flatnonzero(marked & (types == kind) & (sizes == size))
            table = nodes[offsets[cells][:, None] + np.arange(size)]
            dim, form = _KINDS.get((int(kind), int(size)), (0, f"VTK's type {kind}"))
            title = name.partition("/")[2]
            found.append(Block(title, dim, form, table.astype(np.int64) + first))
    return found


def _by_vtk(file: MeshFile) -> dict[str, Any]:
    """Arrays that `vtk_process` writes."""
    program = Path(__file__).with_name("vtk_process.py")
    with tempfile.TemporaryDirectory() as folder:
        cells, source = Path(folder) / "cells.npz", file.path.resolve()
        if source.suffix.lower() in (".xdmf", ".xmf"):
            source = _standard_xdmf(source, Path(folder))
        words = [sys.executable, "-P", str(program), str(source), str(cells)]
        done = subprocess.run(words, capture_output=True, text=True, errors="replace")
        faults = [line for line in done.stderr.splitlines() if re.search(r"ERR\||[Ee]rror", line)]
        if done.returncode == 0 and not faults:
            with np.load(cells) as arrays:
                return dict(arrays)
    said = faults or done.stderr.splitlines()
    if done.returncode < 0 or not said:
        raise SceneError(f"{file} can't be read by VTK: the file is damaged")
    reason = re.sub(r"\x1b\[[0-9;]*m", "", said[0])
    reason = re.sub(r"^.*((ERR|WARN)\||: error :|\): )\s*", "", reason).strip(" .")
    raise SceneError(f"{file} can't be read by VTK: {reason}")


def _standard_xdmf(path: Path, folder: Path) -> Path:
    """A copy in `folder`, beside links to its files of data, with XInclude under its own address.

    DOLFINx 0.11 writes another one, https for http, at which VTK's reader ends with a fault. The
    path itself where data lie above its folder.
    """
    for item in ElementTree.parse(path).iter("DataItem"):
        name = (item.text or "").strip().partition(":")[0]
        if ".." in Path(name).parts:
            return path
        if item.get("Format") == "HDF" and not (folder / name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).symlink_to(path.parent / name)
    copy = folder / path.name
    copy.write_bytes(path.read_bytes().replace(f"https{XINCLUDE}".encode(), XINCLUDE_HTTP))
    return copy


def _check_xdmf(file: MeshFile) -> None:
    """Raise SceneError if an XDMF file is no XML, or names a file of data that is not there."""
    try:
        tree = ElementTree.parse(file.path)
    except (ElementTree.ParseError, OSError) as error:
        raise SceneError(f"{file} is no XDMF file: {error}") from None
    if tree.getroot().tag != "Xdmf":
        raise SceneError(f"{file} is no XDMF file: it begins with <{tree.getroot().tag}>")
    for item in tree.iter("DataItem"):
        name = (item.text or "").strip().partition(":")[0]
        if item.get("Format") == "HDF" and not (file.path.parent / name).is_file():
            raise SceneError(
                f"{file} keeps its data in {name}, which is not beside it; both files "
                "belong together"
            )
