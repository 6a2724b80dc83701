"""Meshes and tags in XDMF, as DOLFINx writes and reads them.

The first grid is the mesh, the others are tags of cells or facets. A tag's number is a name by
`MeshFile.tags`; else all numbers of a grid but 0 have the name of the grid.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from iceslide_fem.mesh.named_cells import FIRST_ORDER, Block, MeshFile, NamedCells, tagged_mesh
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.input_file import companions

_FACETS = {2: "line", 3: "triangle", 4: "quadrilateral"}
# From DOLFINx's order of corners to one around a face.
_ORDER = {"quadrilateral": (0, 1, 3, 2), "hexahedron": (0, 1, 3, 2, 4, 5, 7, 6)}


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells that are named as `file.bodies` and all named sets of facets.

    Raises SceneError if DOLFINx can't read the file, or as `tagged_mesh`.
    """
    from iceslide_fem.fenics.compat import open_xdmf  # a point does without

    title, *names = _grids(file)
    try:
        with open_xdmf(file.path, in_hdf5=bool(companions(file.path))) as opened:
            mesh = opened.read_mesh(name=title)
            for dim in range(mesh.topology.dim):
                mesh.topology.create_entities(dim)
                mesh.topology.create_connectivity(dim, mesh.topology.dim)
            tags = [opened.read_meshtags(mesh, name) for name in names]
            blocks = [block for each in tags for block in _blocks(file, mesh, each)]
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise SceneError(f"{file} can't be read by DOLFINx: {reason}") from None
    points = np.asarray(mesh.geometry.x, dtype=float)
    if mesh.topology.index_map(0).size_local < len(points):
        raise SceneError(f"{file} has nodes beside the corners of cells; {FIRST_ORDER}")
    return tagged_mesh(file, NamedCells(np.arange(len(points)), points, blocks, {}))


def _blocks(file: MeshFile, mesh: Any, tags: Any) -> Iterator[Block]:
    """Named cells of a grid of tags."""
    from iceslide_fem.fenics.compat import cell_name, entity_corners

    title, dim, values = tags.name, tags.dim, np.asarray(tags.values)
    nodes = entity_corners(mesh, dim, tags.indices)
    kind = cell_name(mesh) if dim == mesh.topology.dim else _FACETS[nodes.shape[1]]
    nodes = nodes[:, _ORDER.get(kind, range(nodes.shape[1]))].astype(np.int64)
    if not file.tags:
        yield Block(title, dim, kind, nodes[values != 0])
        return
    for number in np.unique(values).tolist():
        named = (name for name, tag in file.tags if tag == number)
        own = (name for name in named if (name in file.bodies) == (dim == file.dim))
        yield Block(next(own, f"{title} {number}"), dim, kind, nodes[values == number])


def _grids(file: MeshFile) -> list[str]:
    """Names of the grids. Raises SceneError if it is no XDMF file, or a data file is missing."""
    try:
        root = ElementTree.parse(file.path).getroot()
    except (ElementTree.ParseError, OSError) as error:
        raise SceneError(f"{file} is no XDMF file: {error}") from None
    if root.tag != "Xdmf":
        raise SceneError(f"{file} is no XDMF file: it begins with <{root.tag}>")
    for item in root.iter("DataItem"):
        name = (item.text or "").strip().partition(":")[0]
        if item.get("Format") == "HDF" and not (file.path.parent / name).is_file():
            raise SceneError(
                f"{file} keeps its data in {name}, which is not beside it; both files "
                "belong together"
            )
    grids = [grid for grid in root.iter("Grid") if grid.find("Topology") is not None]
    if not grids:
        raise SceneError(f"{file} holds no grid of cells")
    return [str(grid.get("Name")) for grid in grids]
