"""Named cells and facets of a mesh file, and the tagged mesh made from them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.tagged import FACETS, IntArray, TaggedMesh, outer_facets
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError


class Kind(NamedTuple):
    """A kind of cell: dimension, number of nodes, and its number in gmsh."""

    dim: int
    nodes: int
    gmsh: int


KINDS = {
    "line": Kind(1, 2, 1),
    "triangle": Kind(2, 3, 2),
    "quadrilateral": Kind(2, 4, 3),
    "tetrahedron": Kind(3, 4, 4),
    "pyramid": Kind(3, 5, 7),
    "wedge": Kind(3, 6, 6),
    "hexahedron": Kind(3, 8, 5),
}
RUBBER_PARTS = ("contact", "plate", "symmetry", "walls")  # facets of rubber that the program uses
FIRST_ORDER = (
    f"allowed are first-order {', '.join(FACETS)} cells; gmsh.model.mesh.setOrder(1) makes them"
)


class MeshFile(NamedTuple):
    """The mesh file at `path` of the scene's `key`.

    Its cells of dimension `dim` with the names `bodies` are used, and its facets; the program uses
    those with the names `parts`. If `beside` is given, no other names of cells are allowed; else
    others are ignored up to height 0, where ice is, and refused above it. tags: numbers that name
    cells and facets, by name. str() is the begin of a message.
    """

    key: str
    path: Path
    dim: int
    bodies: tuple[str, ...]
    parts: tuple[str, ...]
    beside: tuple[str, ...] | None = None
    tags: tuple[tuple[str, int], ...] = ()

    def __str__(self) -> str:
        return f"{self.key} {self.path}"

    @property
    def body(self) -> str:
        """The names of the cells, for a message."""
        first, *others = (f'"{name}"' for name in self.bodies)
        return f"{first} with {' and '.join(others)}" if others else first


def rubber_file(
    path: Path, dim: int, tags: Iterable[tuple[str, int]] = (), layers: Iterable[str] = ()
) -> MeshFile:
    """A file with the mesh of a tread block; layers: names of cells of other rubber."""
    return MeshFile("rubber.mesh", path, dim, ("rubber", *layers), RUBBER_PARTS, tags=(*tags,))


class Block(NamedTuple):
    """Cells of one kind and name; dim: 1 for lines, 2 for faces, 3 for volumes, 0 for others.

    kind: a key of `KINDS`, or the file's name of another one; nodes (cells, nodes of a cell):
    numbers of nodes.
    """

    name: str
    dim: int
    kind: str
    nodes: IntArray


class NamedCells(NamedTuple):
    """Nodes, cells and node sets of a file.

    numbers: of the nodes (n,); coordinates: (n, 3), in the file's unit; blocks: of cells; sets: of
    nodes, which name the outer facets with all corners in them.
    """

    numbers: IntArray
    coordinates: Array
    blocks: list[Block]
    node_sets: dict[str, IntArray]


def tagged_mesh(file: MeshFile, found: NamedCells) -> TaggedMesh:
    """The cells with the names of `file.bodies`, and all named sets of their facets.

    Unused nodes are dropped, and also facet sets of other cells, unless their name is in
    `file.parts`. A node set is used if no facets have its name. Several bodies become regions of
    the mesh; cells of rubber that have a layer's name, too, are the layer's. Raises SceneError if
    cells are missing, duplicate, of mixed kinds, of another order or dimension or of a forbidden
    name, or if facets do not belong to the cells.
    """
    parts = [
        [block for block in found.blocks if block.name == body and len(block.nodes)]
        for body in file.bodies
    ]
    for body, part in zip(file.bodies, parts, strict=True):
        if not part:
            names = {block.name for block in found.blocks} | set(found.node_sets)
            tags = ", ".join(sorted(names - {""})) or "none"
            raise SceneError(f'{file} has no cells tagged "{body}"; tags found: {tags}')
    if file.beside is None:  # a set of all rubber may hold those of its layers
        parts[0] = _without(parts[0], [block for part in parts[1:] for block in part])
    bodies = [block for part in parts for block in part]
    if {block.dim for block in bodies} - {0, file.dim}:
        raise SceneError(f"{file}: {file.body} must be made of {file.dim}-dimensional cells")
    kind, *others = sorted({block.kind for block in bodies})
    if others:
        kinds = ", ".join([kind, *others])
        raise SceneError(f"{file}: {file.body} mixes cell types ({kinds}); use one")
    if kind not in FACETS:
        raise SceneError(f"{file}: {file.body} is made of {kind} cells; {FIRST_ORDER}")
    sizes = [sum(len(block.nodes) for block in part) for part in parts]
    cells = np.concatenate([block.nodes for block in bodies])
    _check_once(file, cells, np.repeat(file.bodies, sizes))
    _check_others(file, found, cells)
    for block in bodies:
        _places(file, found.numbers, block)
    used, cells = np.unique(cells, return_inverse=True)
    points = found.coordinates[_at(found.numbers, used)[0], : file.dim]
    mesh = TaggedMesh(points, kind, cells.reshape(-1, KINDS[kind].nodes), {}, file.bodies[0])
    if len(parts) > 1:
        split = np.split(np.arange(sum(sizes)), np.cumsum(sizes)[:-1])
        mesh = mesh._replace(regions=dict(zip(file.bodies, split, strict=True)))
    return mesh._replace(facets=_facets(file, mesh, found, used))


def _without(blocks: list[Block], others: list[Block]) -> list[Block]:
    """The `blocks` without the cells that the `others` have, too."""
    taken = {frozenset(cell) for block in others for cell in block.nodes.tolist()}
    kept = (
        np.array([frozenset(cell) not in taken for cell in block.nodes.tolist()])
        for block in blocks
    )
    return [block._replace(nodes=block.nodes[own]) for block, own in zip(blocks, kept, strict=True)]


def _check_once(file: MeshFile, cells: IntArray, names: NDArray[np.str_]) -> None:
    """Raise SceneError for a duplicate of the `cells` (n, corners); names (n,): of bodies."""
    _, first, number = np.unique(
        np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True
    )
    first = first[number.ravel()]
    again = np.flatnonzero(first != np.arange(len(cells)))
    if again.size:
        one, other = names[first[again[0]]], names[again[0]]
        if one == other:
            raise SceneError(f'{file}: "{one}" holds the same cells twice')
        raise SceneError(f'{file}: a cell is tagged "{one}" and "{other}"; allowed is one of them')


def _check_others(file: MeshFile, found: NamedCells, cells: IntArray) -> None:
    """Raise SceneError if cells other than `cells` would be simulated as nothing."""
    allowed = {name.casefold() for name in ("", *file.bodies, *(file.beside or ()))}
    ours = {frozenset(cell) for cell in cells.tolist()}
    names = ", ".join(f'"{name}"' for name in file.bodies)
    for block in found.blocks:
        if block.dim != file.dim or block.name.casefold() in allowed:
            continue
        others = np.array([frozenset(cell) not in ours for cell in block.nodes.tolist()])
        if file.beside is not None and others.any():
            raise SceneError(
                f'{file} has cells tagged "{block.name}", a name that the scene does not have; '
                f"allowed: {names}"
            )
        above = found.coordinates[_places(file, found.numbers, block), file.dim - 1].mean(axis=1)
        if (others & (above > 0.0)).any():
            raise SceneError(
                f'{file} has cells tagged "{block.name}" above the ice, which are not simulated: '
                f"they would be a hole; allowed there: {names}, or its name in rubber.layers"
            )


def _at(numbers: IntArray, wanted: IntArray) -> tuple[IntArray, NDArray[np.bool_]]:
    """Indices of `wanted` numbers among `numbers`, and a mask of those found."""
    order = np.argsort(numbers)
    places = np.searchsorted(numbers, wanted, sorter=order)
    found = order[np.minimum(places, len(numbers) - 1)]
    return found, numbers[found] == wanted


def _places(file: MeshFile, numbers: IntArray, block: Block) -> IntArray:
    """Indices of a block's nodes in the file's `numbers`. Raises SceneError if one is missing."""
    if len(numbers):
        places, known = _at(numbers, block.nodes)
        if known.all():
            return places
    raise SceneError(f'{file}: cells of "{block.name}" have nodes that are not in the file')


def _facets(
    file: MeshFile, mesh: TaggedMesh, found: NamedCells, numbers: IntArray
) -> dict[str, IntArray]:
    """Named facets by nodes of `mesh`; numbers: of these nodes in the file."""
    dim, corners = mesh.points.shape[1], len(FACETS[mesh.cell_type][0])
    sets: dict[str, list[IntArray]] = {}
    for block in found.blocks:
        if not block.name or block.dim != dim - 1 or not len(block.nodes):
            continue
        nodes, known = _at(numbers, block.nodes)
        if nodes.shape[1] == corners and known.all():
            sets.setdefault(block.name, []).append(nodes)
        elif block.name in file.parts:
            what = (
                f"not part of {file.body}"
                if nodes.shape[1] == corners
                else f"of type {block.kind}, which is no facet of a {mesh.cell_type}"
            )
            raise SceneError(f'{file}: facets tagged "{block.name}" are {what}')
    facets = {name: _once(np.concatenate(parts)) for name, parts in sets.items()}
    outer = outer_facets(mesh) if found.node_sets else np.zeros((0, corners), dtype=np.int64)
    for name, nodes in found.node_sets.items():
        chosen = np.isin(numbers, nodes)[outer].all(axis=1)
        if name not in facets and chosen.any():
            facets[name] = outer[chosen]
    return facets


def _once(facets: IntArray) -> IntArray:
    """Facets (n, corners) without duplicates, in order."""
    _, first = np.unique(np.sort(facets, axis=1), axis=0, return_index=True)
    return facets[np.sort(first)]
