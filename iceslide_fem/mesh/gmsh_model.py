"""Meshes with named parts, to and from gmsh, which only this module and `patches` import.

gmsh is GPL-2.0-or-later with exceptions; everything else here only sees `TaggedMesh` arrays and
DOLFINx meshes.
"""

from __future__ import annotations

import itertools
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import gmsh
import numpy as np
from numpy.typing import NDArray

from iceslide_fem.errors import SceneError
from iceslide_fem.mesh.partition import owners

if TYPE_CHECKING:
    from iceslide_fem.fenics.compat import MPI

IntArray = NDArray[np.int64]

_CELLS = {"triangle": 2, "quadrilateral": 3, "tetrahedron": 4, "hexahedron": 5}
_FACETS = {"triangle": 1, "quadrilateral": 1, "tetrahedron": 2, "hexahedron": 3}
_NAMES = {number: name for name, number in _CELLS.items()} | {1: "line"}
_NUMBERS = {name: number for number, name in _NAMES.items()}
_CORNERS = {"line": 2, "triangle": 3, "quadrilateral": 4, "tetrahedron": 4, "hexahedron": 8}


MESH_HEADER = b"$MeshFormat"


class TaggedMesh(NamedTuple):
    """A mesh of one body, undistributed. Nodes of cells and facets are numbered as gmsh does.

    points (n, dim) in m; cell_type triangle, quadrilateral, tetrahedron or hexahedron;
    cells (m, corners); facets: name -> (k, corners of a facet); body: name of the cells.
    """

    points: NDArray[np.float64]
    cell_type: str
    cells: IntArray
    facets: Mapping[str, IntArray]
    body: str


class DistributedMesh(NamedTuple):
    """DOLFINx mesh, its facet tags, and the number of each named set of facets."""

    mesh: Any
    facet_tags: Any
    tags: dict[str, int]


def distribute(tagged: TaggedMesh, comm: MPI.Comm) -> DistributedMesh:
    """Share rank 0's mesh out over `comm` (`partition`); all ranks must give the same names."""
    from iceslide_fem.fenics import compat  # meshes are read and measured without it, too

    dim = tagged.points.shape[1]

    def shared(nodes: NDArray[np.int32]) -> NDArray[np.int32]:
        nodes = nodes.reshape(-1, tagged.cells.shape[1])
        return owners(tagged.points[nodes].mean(axis=1)[:, :-1], comm.size)

    if comm.rank == 0:
        with empty_model() as model:
            _fill(model, tagged)
            mesh, _, facet_tags = compat.mesh_from_gmsh(model, comm, 0, dim, shared)
    else:
        mesh, _, facet_tags = compat.mesh_from_gmsh(None, comm, 0, dim, shared)
    return DistributedMesh(
        mesh, facet_tags, {name: tag for tag, name in enumerate(tagged.facets, 1)}
    )


def save(tagged: TaggedMesh, path: Path) -> None:
    """Write a mesh with its names as physical groups, in the format of the file's suffix."""
    with empty_model() as model:
        _fill(model, tagged)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(str(path))


def load(path: Path, dim: int, body: str) -> TaggedMesh:
    """Read the cells of the physical group `body` and all named sets of facets from a file.

    Raises SceneError where the file is no .msh file of gmsh, or the cells of `body` are missing, of
    another dimension, of several types or of higher order.
    """
    with empty_model() as model:
        _merge(path)
        blocks = []
        for group_dim, group in model.getPhysicalGroups():
            name = model.getPhysicalName(group_dim, group)
            for entity in model.getEntitiesForPhysicalGroup(group_dim, group):
                types, _, nodes = model.mesh.getElements(group_dim, entity)
                for number, tags in zip(types, nodes, strict=True):
                    kind = _NAMES.get(number) or model.mesh.getElementProperties(number)[0]
                    corners = model.mesh.getElementProperties(number)[3]
                    blocks.append((name, group_dim, kind, tags.reshape(-1, corners)))
        numbers, coordinates, _ = model.mesh.getNodes()
    return from_blocks(path, dim, body, numbers, coordinates.reshape(-1, 3), blocks)


def _merge(path: Path) -> None:
    """Read a .msh file into the current model.

    gmsh takes anything else for a script and runs it, with the shell commands in it; beside a mesh
    it also looks for a file of options. So it is given a copy, alone, of what begins as a mesh.
    """
    with tempfile.TemporaryDirectory() as alone:
        copy = Path(alone) / "mesh.msh"
        try:
            shutil.copyfile(path, copy)
        except OSError as error:
            raise SceneError(
                f"rubber.mesh {path} can't be read: {error.strerror or error}"
            ) from None
        with open(copy, "rb") as file:
            first = file.readline(100).rstrip()
        if first != MESH_HEADER:
            raise SceneError(
                f"rubber.mesh {path} is no mesh file of gmsh: its first line is not "
                f'"{MESH_HEADER.decode()}" (scripts of gmsh are not run)'
            )
        try:
            gmsh.merge(str(copy))
        except Exception as error:  # gmsh raises nothing more specific
            reason = str(error).strip().replace(str(copy), path.name)
            raise SceneError(f"rubber.mesh {path} can't be read by gmsh: {reason}") from None


def from_blocks(
    path: Path,
    dim: int,
    body: str,
    numbers: IntArray,
    coordinates: NDArray[np.float64],
    blocks: list[tuple[str, int, str, IntArray]],
) -> TaggedMesh:
    """TaggedMesh of the blocks (name, dimension, element type, nodes) read from a file.

    `numbers` (n,) are the node numbers that the blocks use, `coordinates` (n, 3) their places;
    nodes that no cell of `body` uses are left out. Raises SceneError as `load` does.
    """
    bodies = [block for block in blocks if block[0] == body]
    if not bodies:
        found = ", ".join(sorted({block[0] for block in blocks} - {""})) or "none"
        raise SceneError(f'rubber.mesh {path} has no cells tagged "{body}"; tags found: {found}')
    if {block[1] for block in bodies} != {dim}:
        raise SceneError(f'rubber.mesh {path}: "{body}" must be made of {dim}-dimensional cells')
    kinds = sorted({block[2] for block in bodies})
    if len(kinds) > 1:
        raise SceneError(
            f'rubber.mesh {path}: "{body}" mixes cell types ({", ".join(kinds)}); use one'
        )
    kind = kinds[0]
    if kind not in _CELLS:
        raise SceneError(
            f'rubber.mesh {path}: "{body}" is made of {kind} cells; allowed are first-order '
            f"{', '.join(_CELLS)}"
        )
    cells = np.concatenate([block[3] for block in bodies])
    if len(np.unique(np.sort(cells, axis=1), axis=0)) < len(cells):
        raise SceneError(f'rubber.mesh {path}: "{body}" holds the same cells twice')
    used, cells = np.unique(cells, return_inverse=True)
    sorter = np.argsort(numbers)
    place = sorter[np.minimum(np.searchsorted(numbers, used, sorter=sorter), len(numbers) - 1)]
    if not np.array_equal(numbers[place], used):
        raise SceneError(
            f'rubber.mesh {path}: cells of "{body}" have nodes that are not in the file'
        )
    points = coordinates[place, :dim]
    facets: dict[str, IntArray] = {}
    for name, block_dim, facet, nodes in blocks:
        if name and block_dim == dim - 1:
            if _NUMBERS.get(facet) != _FACETS[kind]:
                raise SceneError(
                    f'rubber.mesh {path}: facets tagged "{name}" are of type {facet}, which is no '
                    f"facet of a first-order {kind}"
                )
            local = np.minimum(np.searchsorted(used, nodes), len(used) - 1)
            if not np.array_equal(used[local], nodes):
                raise SceneError(
                    f'rubber.mesh {path}: facets tagged "{name}" are not part of "{body}"'
                )
            facets[name] = np.concatenate([facets[name], local]) if name in facets else local
    return TaggedMesh(points, kind, cells.reshape(-1, _CORNERS[kind]), facets, body)


@contextmanager
def empty_model() -> Iterator[Any]:
    """An empty gmsh model; leaves a gmsh session of the caller as it was."""
    own = not gmsh.isInitialized()
    if own:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    previous = "" if own else gmsh.model.getCurrent()
    terminal = gmsh.option.getNumber("General.Terminal")
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add(_unused_name())
    try:
        yield gmsh.model
    finally:
        gmsh.model.remove()
        gmsh.option.setNumber("General.Terminal", terminal)
        if own:
            gmsh.finalize()
            _restore_signal_handlers()
        elif previous:
            gmsh.model.setCurrent(previous)


def _restore_signal_handlers() -> None:
    """gmsh leaves the system's own handlers behind, and Python's would never hear of a signal."""
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, signal.getsignal(number))


def _unused_name() -> str:
    taken = set(gmsh.model.list())
    return next(name for n in itertools.count() if (name := f"iceslide-{n}") not in taken)


def _fill(model: Any, tagged: TaggedMesh) -> None:
    """Put a mesh into the current model, one discrete entity and physical group for each name."""
    count, dim = tagged.points.shape
    coordinates = np.zeros((count, 3))
    coordinates[:, :dim] = tagged.points
    entity = model.addDiscreteEntity(dim)
    model.mesh.addNodes(dim, entity, np.arange(1, count + 1), coordinates.ravel())
    model.mesh.addElementsByType(entity, _CELLS[tagged.cell_type], [], tagged.cells.ravel() + 1)
    model.addPhysicalGroup(dim, [entity], 1, tagged.body)
    for tag, (name, nodes) in enumerate(tagged.facets.items(), 1):
        if len(nodes):
            part = model.addDiscreteEntity(dim - 1)
            model.mesh.addElementsByType(part, _FACETS[tagged.cell_type], [], nodes.ravel() + 1)
            model.addPhysicalGroup(dim - 1, [part], tag, name)
