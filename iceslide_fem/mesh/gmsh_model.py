"""Meshes with named parts, to and from gmsh, which only this module and `patches` import.

gmsh is GPL-2.0-or-later with exceptions; everything else here only sees `TaggedMesh` arrays and
DOLFINx meshes.
"""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import gmsh
import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.mesh_file import MeshFile
from iceslide_fem.mesh.named_cells import Block, NamedCells, tagged_mesh
from iceslide_fem.mesh.partition import owners
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.ranks import from_root

if TYPE_CHECKING:
    from iceslide_fem.fenics.compat import MPI

_NUMBERS = {  # of gmsh, by the kinds of `named_cells`
    "line": 1,
    "triangle": 2,
    "quadrilateral": 3,
    "tetrahedron": 4,
    "hexahedron": 5,
    "line3": 8,
    "triangle6": 9,
    "quadrilateral9": 10,
    "tetrahedron10": 11,
    "hexahedron27": 12,
    "quadrilateral8": 16,
    "hexahedron20": 17,
}
_NAMES = {number: name for name, number in _NUMBERS.items()}
_WRONG_START = {
    ".msh": 'no mesh file of gmsh: its first line is not "$MeshFormat" (scripts of gmsh are not '
    "run)",
    ".med": "no MED file: it does not begin as HDF5 does",
}
_FACETS = {"triangle": 1, "quadrilateral": 1, "tetrahedron": 2, "hexahedron": 3}
SIGNATURES = {".msh": b"$MeshFormat", ".med": b"\x89HDF\r\n"}  # the first line of a file


class DistributedMesh(NamedTuple):
    """DOLFINx mesh; tags of its facets and the number of each named set of them; tags of its cells,
    of ghosts, too, and the number of each region.
    """

    mesh: Any
    facet_tags: Any
    tags: dict[str, int]
    cell_tags: Any
    regions: dict[str, int]


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
            mesh, cell_tags, facet_tags = compat.mesh_from_gmsh(model, comm, 0, dim, shared)
    else:
        mesh, cell_tags, facet_tags = compat.mesh_from_gmsh(None, comm, 0, dim, shared)
    facets, regions = (_numbered(names) for names in (tagged.facets, tagged.named_cells))
    return DistributedMesh(mesh, facet_tags, facets, cell_tags, regions)


def distribute_made(make: Callable[[], TaggedMesh], comm: MPI.Comm) -> DistributedMesh:
    """Share out what rank 0 alone makes: the others know its names, and get their parts.

    Collective; all ranks raise what rank 0 does.
    """
    made: list[TaggedMesh] = []

    def names() -> TaggedMesh:
        made.append(make())
        return made[0].empty

    empty = from_root(names, comm)
    return distribute(made[0] if made else empty, comm)


def _numbered(names: Iterable[str]) -> dict[str, int]:
    return {name: number for number, name in enumerate(names, 1)}


def save(tagged: TaggedMesh, path: Path) -> None:
    """Write a mesh with its names as physical groups, in the format of the file's suffix."""
    with empty_model() as model:
        _fill(model, tagged)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(str(path))


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells of the physical groups `file.bodies` and all named sets of facets.

    Raises SceneError where the file is none of `SIGNATURES`, or as `tagged_mesh` does.
    """
    with empty_model() as model:
        _merge(file)
        blocks = []
        for group_dim, group in model.getPhysicalGroups():
            name = model.getPhysicalName(group_dim, group).strip(" \0")  # MED fills them up
            for entity in model.getEntitiesForPhysicalGroup(group_dim, group):
                types, _, nodes = model.mesh.getElements(group_dim, entity)
                for number, tags in zip(types, nodes, strict=True):
                    kind, _, _, count, *_ = model.mesh.getElementProperties(number)
                    kind = _NAMES.get(number, kind)
                    cells = tags.reshape(-1, count).astype(np.int64)
                    blocks.append(Block(name, group_dim, kind, cells))
        numbers, coordinates, _ = model.mesh.getNodes()
    found = NamedCells(numbers.astype(np.int64), coordinates.reshape(-1, 3), blocks, {})
    return tagged_mesh(file, found)


def _merge(file: MeshFile) -> None:
    """Read a .msh or .med file into the current model.

    gmsh takes anything else for a script and runs it, with the shell commands in it; beside a mesh
    it also looks for a file of options. So it is given a copy, alone, of what begins as a mesh.
    """
    path = file.path
    suffix = ".med" if path.suffix.lower() == ".med" else ".msh"
    with tempfile.TemporaryDirectory() as alone:
        copy = Path(alone) / f"mesh{suffix}"
        try:
            shutil.copyfile(path, copy)
        except OSError as error:
            raise SceneError(f"{file} can't be read: {error.strerror or error}") from None
        with open(copy, "rb") as start:
            first = start.readline(100).rstrip()
        if first != SIGNATURES[suffix].rstrip():
            raise SceneError(f"{file} is {_WRONG_START[suffix]}")
        try:
            with _quiet_library():
                gmsh.merge(str(copy))
        except Exception as error:  # gmsh raises nothing more specific
            reason = str(error).strip().replace(str(copy), path.name)
            raise SceneError(f"{file} can't be read by gmsh: {reason}") from None


@contextmanager
def _quiet_library() -> Iterator[None]:
    """Keep what the MED library prints of a bad file off the screen: it knows no Python."""
    sys.stderr.flush()
    screen, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(screen, 2)
        os.close(screen)
        os.close(nothing)


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
    entities = {name: model.addDiscreteEntity(dim) for name in tagged.named_cells}
    first = next(iter(entities.values()))
    model.mesh.addNodes(dim, first, np.arange(1, count + 1), coordinates.ravel())
    for tag, (name, chosen) in enumerate(tagged.named_cells.items(), 1):
        cells = tagged.cells[chosen].ravel() + 1
        model.mesh.addElementsByType(entities[name], _NUMBERS[tagged.cell_type], [], cells)
        model.addPhysicalGroup(dim, [entities[name]], tag, name)
    for tag, (name, nodes) in enumerate(tagged.facets.items(), 1):
        if len(nodes):
            part = model.addDiscreteEntity(dim - 1)
            model.mesh.addElementsByType(part, _FACETS[tagged.cell_type], [], nodes.ravel() + 1)
            model.addPhysicalGroup(dim - 1, [part], tag, name)
