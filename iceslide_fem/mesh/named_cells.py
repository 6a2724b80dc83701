"""What a mesh file holds: cells and facets with names; and the tagged mesh that is wanted of it.

Second-order cells are taken by their corners where their other nodes are in the middle of edges,
faces and cells, which changes no shape. Curved ones are refused.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.mesh_file import MeshFile
from iceslide_fem.mesh.soundness import FACETS, outer_facets
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.errors import SceneError

Floats = NDArray[np.float64]

DIMENSIONS = {"line": 1, "triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}
CORNERS = {"line": 2, "triangle": 3, "quadrilateral": 4, "tetrahedron": 4, "hexahedron": 8}
SECOND_ORDER = {  # kind: the first-order kind that its first nodes are
    "line3": "line",
    "triangle6": "triangle",
    "triangle7": "triangle",
    "quadrilateral8": "quadrilateral",
    "quadrilateral9": "quadrilateral",
    "tetrahedron10": "tetrahedron",
    "hexahedron20": "hexahedron",
    "hexahedron27": "hexahedron",
}
STRAIGHT = 1e-3  # of a cell's size: so near to the middle a node is in the middle
CHUNK = 2_000  # cells whose nodes are looked at at a time
_FACET_OF = {2: {"line"}, 3: {"triangle", "quadrilateral"}}


class Block(NamedTuple):
    """Cells of one kind and name; dim: 1 for lines, 2 for faces, 3 for volumes, 0 for others.

    kind: a key of `DIMENSIONS` or `SECOND_ORDER`, or what the file calls one that can't be used;
    nodes (cells, nodes of a cell): numbers of nodes, the corners first.
    """

    name: str
    dim: int
    kind: str
    nodes: IntArray


class NamedCells(NamedTuple):
    """numbers (n,) of the nodes of a file and their coordinates (n, 3), in the file's unit; blocks
    of cells; and sets of nodes, which name the outer facets whose corners they hold.
    """

    numbers: IntArray
    coordinates: Floats
    blocks: list[Block]
    node_sets: dict[str, IntArray]


def tagged_mesh(file: MeshFile, found: NamedCells) -> TaggedMesh:
    """The cells with the names of `file.bodies`, and all named sets of their facets.

    Nodes that none of these cells has are left out, and so are sets of facets that belong to
    others, unless their name is one of `file.parts`. A set of nodes counts where no facets have its
    name. Several bodies are the regions of the mesh. Raises SceneError where their cells are
    missing, of another dimension, of several kinds, curved, or there twice, where cells have a name
    that they must not have, and where facets are not those of the cells.
    """
    parts = [[block for block in found.blocks if block.name == body] for body in file.bodies]
    for body, part in zip(file.bodies, parts, strict=True):
        if not any(len(block.nodes) for block in part):
            raise SceneError(f'{file} has no cells tagged "{body}"; tags found: {names_of(found)}')
    bodies = [block for part in parts for block in part if len(block.nodes)]
    if {block.dim for block in bodies} - {0} not in (set(), {file.dim}):
        raise SceneError(f"{file}: {file.body} must be made of {file.dim}-dimensional cells")
    kinds = sorted({SECOND_ORDER.get(block.kind, block.kind) for block in bodies})
    if len(kinds) > 1:
        raise SceneError(f"{file}: {file.body} mixes cell types ({', '.join(kinds)}); use one")
    kind = kinds[0]
    if kind not in FACETS:
        raise SceneError(
            f"{file}: {file.body} is made of {kind} cells; allowed are first- and "
            f"second-order {', '.join(FACETS)}"
        )
    sizes = [sum(len(block.nodes) for block in part) for part in parts]
    cells = np.concatenate([block.nodes[:, : CORNERS[kind]] for block in bodies])
    _check_once(file, cells, np.repeat(file.bodies, sizes))
    _check_others(file, found, cells)
    sorter = np.argsort(found.numbers)
    for block in bodies:
        _check_straight(file, block, found.coordinates[_places(file, found, sorter, block)])
    used, cells = np.unique(cells, return_inverse=True)
    places = sorter[np.searchsorted(found.numbers, used, sorter=sorter)]
    points = found.coordinates[places, : file.dim]
    mesh = TaggedMesh(points, kind, cells.reshape(-1, CORNERS[kind]), {}, file.bodies[0])
    if len(parts) > 1:
        split = np.split(np.arange(sum(sizes)), np.cumsum(sizes)[:-1])
        mesh = mesh._replace(regions=dict(zip(file.bodies, split, strict=True)))
    return mesh._replace(facets=_facets(file, mesh, found, used))


def _check_once(file: MeshFile, cells: IntArray, names: NDArray[np.str_]) -> None:
    """Raise SceneError if one of the `cells` (n, corners) is there twice; names (n,): of bodies."""
    _, first, number = np.unique(
        np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True
    )
    again = np.flatnonzero(first[number.ravel()] != np.arange(len(cells)))
    if again.size:
        one, other = names[first[number.ravel()[again[0]]]], names[again[0]]
        if one == other:
            raise SceneError(f'{file}: "{one}" holds the same cells twice')
        raise SceneError(f'{file}: a cell is tagged "{one}" and "{other}"; allowed is one of them')


def _check_others(file: MeshFile, found: NamedCells, cells: IntArray) -> None:
    """Raise SceneError if cells that are none of `cells` have a name that they must not have."""
    if file.beside is None:
        return
    allowed = {name.casefold() for name in (*file.bodies, *file.beside)}
    ours = {frozenset(cell) for cell in cells.tolist()}
    for block in found.blocks:
        if not block.name or block.dim != file.dim or block.name.casefold() in allowed:
            continue
        kind = SECOND_ORDER.get(block.kind, block.kind)
        corners = block.nodes[:, : CORNERS.get(kind)].tolist()
        if any(frozenset(cell) not in ours for cell in corners):
            names = ", ".join(f'"{name}"' for name in file.bodies)
            raise SceneError(
                f'{file} has cells tagged "{block.name}", a name that the scene does not have; '
                f"allowed: {names}"
            )


def _places(file: MeshFile, found: NamedCells, sorter: IntArray, block: Block) -> IntArray:
    """Where the nodes of a block stand in the file's list."""
    at = np.searchsorted(found.numbers, block.nodes, sorter=sorter)
    known = at < len(sorter)
    places = sorter[np.where(known, at, 0)] if len(sorter) else np.zeros_like(at)
    if not (known.all() and np.array_equal(found.numbers[places], block.nodes)):
        raise SceneError(f'{file}: cells of "{block.name}" have nodes that are not in the file')
    return places


def names_of(found: NamedCells) -> str:
    """The names that a file has, for a message."""
    names = {block.name for block in found.blocks} | set(found.node_sets)
    return ", ".join(sorted(names - {""})) or "none"


def _facets(
    file: MeshFile, mesh: TaggedMesh, found: NamedCells, numbers: IntArray
) -> dict[str, IntArray]:
    """Named facets by the nodes of `mesh`, whose `numbers` in the file are sorted."""

    def local(nodes: IntArray) -> tuple[IntArray, NDArray[np.bool_]]:
        at = np.minimum(np.searchsorted(numbers, nodes), len(numbers) - 1)
        return at, numbers[at] == nodes

    dim = mesh.points.shape[1]
    corners = len(FACETS[mesh.cell_type][0])
    sets: dict[str, list[IntArray]] = {}
    for block in found.blocks:
        if not block.name or block.dim != dim - 1 or not len(block.nodes):
            continue
        kind = SECOND_ORDER.get(block.kind, block.kind)
        if kind not in _FACET_OF[dim] or CORNERS[kind] != corners:
            if block.name in file.parts:
                raise SceneError(
                    f'{file}: facets tagged "{block.name}" are of type {block.kind}, '
                    f"which is no facet of a {mesh.cell_type}"
                )
            continue
        nodes, known = local(block.nodes[:, :corners])
        if known.all():
            sets.setdefault(block.name, []).append(nodes)
        elif block.name in file.parts:
            raise SceneError(f'{file}: facets tagged "{block.name}" are not part of {file.body}')
    facets = {name: _once(np.concatenate(parts)) for name, parts in sets.items()}
    outer = outer_facets(mesh) if found.node_sets else np.zeros((0, corners), dtype=np.int64)
    for name, nodes in found.node_sets.items():
        at, known = local(nodes)
        inside = np.zeros(len(numbers), dtype=bool)
        inside[at[known]] = True
        if name not in facets and (chosen := inside[outer].all(axis=1)).any():
            facets[name] = outer[chosen]
    return facets


def _once(facets: IntArray) -> IntArray:
    """Facets (n, corners), each of them once, in their order."""
    _, first = np.unique(np.sort(facets, axis=1), axis=0, return_index=True)
    return facets[np.sort(first)]


def _check_straight(file: MeshFile, block: Block, points: Floats) -> None:
    """Raise SceneError if nodes (cells, nodes, 3) that are no corners are not in a middle."""
    kind = SECOND_ORDER.get(block.kind)
    if kind is None:
        return
    corners = CORNERS[kind]
    shares = _middles(kind)
    for start in range(0, len(points), CHUNK):
        some = points[start : start + CHUNK]
        middles = shares @ some[:, :corners]
        size = np.linalg.norm(np.ptp(some[:, :corners], axis=1), axis=1)
        apart = np.linalg.norm(some[:, corners:, None] - middles[:, None], axis=3).min(axis=2)
        wrong = np.argwhere(~(apart <= STRAIGHT * size[:, None]))
        if len(wrong):
            cell, node = wrong[0]
            where = ", ".join(f"{x:.6g}" for x in some[cell, corners + node])
            raise SceneError(
                f'{file}: "{block.name}" has curved second-order cells: the node at '
                f"({where}) is not in the middle of its edge; save first-order (linear) cells"
            )


def _middles(kind: str) -> Floats:
    """Shares of the corners in the middles of edges, faces and the cell: (middles, corners)."""
    faces = FACETS.get(kind, [])
    edges = {
        tuple(sorted(edge))
        for face in faces
        for edge in zip(face, face[1:] + face[:1], strict=True)
    }
    groups = [*edges, *faces, tuple(range(CORNERS[kind]))]
    shares = np.zeros((len(groups), CORNERS[kind]))
    for row, group in zip(shares, groups, strict=True):
        row[list(group)] = 1.0 / len(group)
    return shares
