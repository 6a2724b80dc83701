"""Meshes with named parts, to and from gmsh. Only this module, `patches` and `outline` import it.

gmsh is GPL-2.0-or-later with exceptions. The rest of the package uses `TaggedMesh` arrays and
DOLFINx meshes.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import gmsh
import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.named_cells import KINDS, Block, MeshFile, NamedCells, tagged_mesh
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.ranks import from_root

if TYPE_CHECKING:
    from iceslide_fem.fenics.compat import MPI

_one_at_a_time = threading.RLock()
_NAMES = {kind.gmsh: name for name, kind in KINDS.items()}
FACETS = {"triangle": "line", "quadrilateral": "line"}
FACETS |= {"tetrahedron": "triangle", "hexahedron": "quadrilateral"}


class DistributedMesh(NamedTuple):
    """DOLFINx mesh with facet tags and cell tags (ghosts included), and the numbers of names."""

    mesh: Any
    facet_tags: Any
    tags: dict[str, int]
    cell_tags: Any = None
    regions: Mapping[str, int] = {}  # noqa: RUF012 - nobody writes to it


def distribute(tagged: TaggedMesh, comm: MPI.Comm) -> DistributedMesh:
    """Distribute rank 0's mesh over `comm` (`owners`); all ranks give the same names."""
    # not needed to read and measure meshes
    from iceslide_fem.fenics import compat
    from iceslide_fem.fenics.garbage import keep_until_freed

    def shared(nodes: NDArray[np.int32]) -> NDArray[np.int32]:
        nodes = nodes.reshape(-1, tagged.cells.shape[1])
        return owners(tagged.points[nodes].mean(axis=1)[:, :-1], comm.size)

    with empty_model() if comm.rank == 0 else nullcontext() as model:
        if model is not None:
            _fill(model, tagged)
        dim = tagged.points.shape[1]
        mesh, cell_tags, facet_tags = compat.mesh_from_gmsh(model, comm, 0, dim, shared)
    keep_until_freed(mesh)
    facets, regions = (
        {name: number for number, name in enumerate(names, 1)}
        for names in (tagged.facets, tagged.named_cells)
    )
    return DistributedMesh(mesh, facet_tags, facets, cell_tags, regions)


def owners(middles: Array, ranks: int) -> NDArray[np.int32]:
    """Rank of each cell, in equal numbers, by recursive bisection across the longer side.

    middles: horizontal positions of the cell centres (n, d-1), m. Cuts are vertical, so every rank
    gets a part of the contact. A graph partitioner may cut a cube between plate and ice, which
    leaves the contact to one rank.
    """
    found = np.zeros(len(middles), dtype=np.int32)
    size = np.ptp(middles, axis=0).max(initial=0.0) if len(middles) else 0.0
    places = np.round(middles / (size or 1.0), 9)  # cells of one column have equal positions

    def share(cells: NDArray[np.intp], first: int, count: int) -> None:
        if count == 1 or not cells.size:
            found[cells] = first
            return
        axis = int(np.ptp(places[cells], axis=0).argmax())
        others = np.delete(places[cells], axis, axis=1)
        cells = cells[np.lexsort([*others.T, places[cells, axis]])]
        low = count // 2
        cut = round(cells.size * low / count)
        share(cells[:cut], first, low)
        share(cells[cut:], first + low, count - low)

    share(np.arange(len(middles)), 0, ranks)
    return found


def distribute_made(make: Callable[[], TaggedMesh], comm: MPI.Comm) -> DistributedMesh:
    """Distribute a mesh that rank 0 makes. Collective; all ranks raise the errors of rank 0."""
    made: list[TaggedMesh] = []

    def names() -> TaggedMesh:
        made.append(make())
        return made[0].empty

    empty = from_root(names, comm)
    return distribute(made[0] if made else empty, comm)


def save(tagged: TaggedMesh, path: Path) -> None:
    """Write a mesh with its names as physical groups, in the format of the file's suffix."""
    with empty_model() as model:
        _fill(model, tagged)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(str(path))


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells of the physical groups `file.bodies` and all named sets of facets.

    Raises SceneError if the file is no .msh or .med, or as `tagged_mesh`.
    """
    with empty_model() as model:
        _merge(file)
        blocks = []
        for dim, group in model.getPhysicalGroups():
            name = model.getPhysicalName(dim, group).strip(" \0")  # MED pads names
            for entity in model.getEntitiesForPhysicalGroup(dim, group):
                types, _, nodes = model.mesh.getElements(dim, entity)
                for number, tags in zip(types, nodes, strict=True):
                    title, _, _, count, *_ = model.mesh.getElementProperties(number)
                    cells = tags.reshape(-1, count).astype(np.int64)
                    blocks.append(Block(name, dim, _NAMES.get(number, title), cells))
        numbers, coordinates, _ = model.mesh.getNodes()
    found = NamedCells(numbers.astype(np.int64), coordinates.reshape(-1, 3), blocks, {})
    return tagged_mesh(file, found)


def _merge(file: MeshFile) -> None:
    """Read a .msh or .med file into the current model.

    gmsh executes any other file as a script, with its shell commands, and reads an option file
    beside a mesh. It therefore gets an isolated copy of a file that begins as a mesh.
    """
    med = file.path.suffix.lower() == ".med"
    with tempfile.TemporaryDirectory() as alone:
        copy = Path(alone) / ("mesh.med" if med else "mesh.msh")
        try:
            shutil.copyfile(file.path, copy)
        except OSError as error:
            raise SceneError(f"{file} can't be read: {error.strerror or error}") from None
        with open(copy, "rb") as start:
            first = start.readline(100).rstrip()
        if med and first != b"\x89HDF":
            raise SceneError(f"{file} is no MED file: it does not begin as HDF5 does")
        if not med and first != b"$MeshFormat":
            raise SceneError(
                f'{file} is no mesh file of gmsh: its first line is not "$MeshFormat" (scripts of '
                "gmsh are not run)"
            )
        try:
            with _quiet_library():
                gmsh.merge(str(copy))
        except Exception as error:  # gmsh raises nothing more specific
            reason = str(error).strip().replace(str(copy), file.path.name)
            raise SceneError(f"{file} can't be read by gmsh: {reason}") from None


@contextmanager
def _quiet_library() -> Iterator[None]:
    """Suppress what the MED library prints about a bad file."""
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
    """An empty gmsh model with gmsh's default options, for one thread at a time.

    A gmsh session of the caller has its models and options as they were afterwards.
    """
    with _one_at_a_time, _own_session() if not gmsh.isInitialized() else _beside_the_callers():
        gmsh.model.add("iceslide_fem")
        try:
            yield gmsh.model
        finally:
            gmsh.model.remove()


@contextmanager
def _own_session() -> Iterator[None]:
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield
    finally:
        gmsh.finalize()
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGTERM, signal.SIGINT):  # gmsh resets the handlers
                signal.signal(number, signal.getsignal(number))


@contextmanager
def _beside_the_callers() -> Iterator[None]:
    model, terminal = gmsh.model.getCurrent(), gmsh.option.getNumber("General.Terminal")
    gmsh.option.setNumber("General.Terminal", 0)
    with tempfile.TemporaryDirectory() as folder:
        options = str(Path(folder) / "callers.opt")  # those that are not the default
        gmsh.write(options)
        gmsh.option.restoreDefaults()
        try:
            yield
        finally:
            gmsh.option.restoreDefaults()
            gmsh.merge(options)
            gmsh.option.setNumber("General.Terminal", terminal)
            if model:
                gmsh.model.setCurrent(model)


def nodes_of(model: Any, cells: IntArray) -> tuple[Array, IntArray]:
    """Coordinates (n, 3) of the nodes of `cells` (gmsh's numbers), and `cells` as indices of
    them.
    """
    numbers, coordinates, _ = model.mesh.getNodes()
    used, places = np.unique(cells, return_inverse=True)
    order = np.argsort(numbers)
    points = coordinates.reshape(-1, 3)[order[np.searchsorted(numbers, used, sorter=order)]]
    return points, places


QUADRILATERALS = {
    "Mesh.Algorithm": 8,  # triangles that pair to good quadrilaterals
    "Mesh.RecombinationAlgorithm": 2,  # leaves quadrilaterals only
}


def grade(
    model: Any,
    kind: str,
    entities: Sequence[int],
    sizes: tuple[float, float, float],
    sampling: int,
    options: Mapping[str, int],
) -> None:
    """Give the current model sizes of cells by the distance to curves ("CurvesList") or points
    ("PointsList").

    sizes: the smallest one, its growth per distance, and the largest one; sampling: points of a
    curve from which distances count; options: of gmsh, beside those that leave sizes to the field.
    """
    field = model.mesh.field
    distance, growth = field.add("Distance"), field.add("MathEval")
    field.setNumbers(distance, kind, entities)
    field.setNumber(distance, "Sampling", sampling)
    smallest, slope, largest = sizes
    field.setString(growth, "F", f"Min({smallest:.9g} + {slope:.9g} * F{distance}, {largest:.9g})")
    field.setAsBackgroundMesh(growth)
    of_field = ("ExtendFromBoundary", "FromPoints", "FromCurvature")
    for name, value in {**{f"Mesh.MeshSize{one}": 0 for one in of_field}, **options}.items():
        gmsh.option.setNumber(name, value)


def _fill(model: Any, tagged: TaggedMesh) -> None:
    """Add a mesh to the current model, one discrete entity and physical group for each name."""
    count, dim = tagged.points.shape
    coordinates = np.zeros((count, 3))
    coordinates[:, :dim] = tagged.points
    entities = {name: model.addDiscreteEntity(dim) for name in tagged.named_cells}
    first = next(iter(entities.values()))
    model.mesh.addNodes(dim, first, np.arange(1, count + 1), coordinates.ravel())

    def add(dim: int, entity: int, kind: str, nodes: IntArray, tag: int, name: str) -> None:
        model.mesh.addElementsByType(entity, KINDS[kind].gmsh, [], nodes.ravel() + 1)
        model.addPhysicalGroup(dim, [entity], tag, name)

    for tag, (name, chosen) in enumerate(tagged.named_cells.items(), 1):
        add(dim, entities[name], tagged.cell_type, tagged.cells[chosen], tag, name)
    for tag, (name, nodes) in enumerate(tagged.facets.items(), 1):
        if len(nodes):
            part = model.addDiscreteEntity(dim - 1)
            add(dim - 1, part, FACETS[tagged.cell_type], nodes, tag, name)
