"""Readers of mesh files, and checks of format, size and facets.

The suffix of a file determines its reader, and the meaning of names: a physical group or a MED
group (`gmsh_model`), a set or a surface (`abaqus`), tags (`xdmf`).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from iceslide_fem.mesh import abaqus, gmsh_model, xdmf
from iceslide_fem.mesh.named_cells import MeshFile
from iceslide_fem.mesh.soundness import Fault, place
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, among
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.input_file import companions

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}  # of coordinates, in m
LARGEST_FILE = 1_000_000_000  # bytes
TOLERANCE = 1e-6  # of the height: tolerance of a plane

READERS: dict[str, Callable[[MeshFile], TaggedMesh]] = {  # by suffixes
    ".msh": gmsh_model.load,
    ".med": gmsh_model.load,
    ".inp": abaqus.load,
    ".xdmf": xdmf.load,
}


def stamps(file: MeshFile) -> tuple[int, ...]:
    """Sizes and times of the file and of files that it includes, to detect changes.

    Raises SceneError if it can't be read or is too large.
    """
    try:
        status = file.path.stat()
    except OSError as error:
        raise SceneError(f"{file} can't be read: {error.strerror}") from None
    if status.st_size > LARGEST_FILE:
        raise SceneError(
            f"{file} has {status.st_size / 1e6:.0f} MB; allowed: up to {LARGEST_FILE / 1e6:.0f} MB"
        )
    changed = [other.stat().st_mtime_ns for other in companions(file.path)]
    return (status.st_size, status.st_mtime_ns, *changed)


def read(
    file: MeshFile, unit: str, needed: tuple[str, ...], sizes: tuple[float, float]
) -> TaggedMesh:
    """The file's mesh with the facets of `file.parts`, in m.

    unit: of the file's coordinates (`UNITS`); needed: names that facets must have; sizes: smallest
    and largest allowed size, m. Raises SceneError if the file can't be read or violates these.
    """
    suffix = file.path.suffix.lower()
    if suffix not in READERS:
        raise SceneError(f"{file}: {_other_format(suffix)}")
    if file.tags and READERS[suffix] is not xdmf.load:
        raise SceneError(
            f'{file}: parts of files "*{suffix}" have names; {file.key}_tags are of .xdmf'
        )
    tagged = READERS[suffix](file)
    for name in needed:
        if name not in tagged.facets:
            found = ", ".join(tagged.facets) or "none"
            raise SceneError(f'{file} has no facets tagged "{name}"; tags found: {found}')
    known = {name: tagged.facets[name] for name in file.parts if name in tagged.facets}
    tagged = tagged._replace(points=UNITS[unit] * tagged.points, facets=known)
    _check_size(file, tagged, unit, sizes)
    return tagged


def _other_format(suffix: str) -> str:
    allowed = f"allowed are {', '.join(READERS)}"
    if suffix in (".bdf", ".nas", ".fem", ".dat"):
        return f"files of Nastran ({suffix}) have no names for sets of facets; {allowed}"
    if suffix in (".vtu", ".vtk", ".xmf"):
        return f"files of VTK ({suffix}) are not read: meshio convert makes .msh of them; {allowed}"
    what = f'files "*{suffix}" are not read' if suffix else "its name has no suffix"
    return f"{what}; {allowed}; save it as one of these with the program that made it"


def _check_size(file: MeshFile, tagged: TaggedMesh, unit: str, sizes: tuple[float, float]) -> None:
    """Raise SceneError if coordinates are not finite or seem to be in another unit."""
    wrong = np.count_nonzero(~np.isfinite(tagged.points).all(axis=1))
    if wrong:
        raise SceneError(
            f"{file}: the coordinates of {wrong} of {len(tagged.points)} nodes "
            "are not finite numbers"
        )
    size = np.ptp(tagged.points, axis=0).max()
    smallest, largest = sizes
    if not smallest <= size <= largest:
        raise SceneError(
            f"{file} is {size:g} m large; allowed: {smallest:g} to {largest:g} m; "
            f'{file.key}_unit = "{unit}" says in which unit it was drawn, allowed: '
            f"{', '.join(UNITS)}"
        )
    if np.ptp(tagged.points[:, -1]) <= TOLERANCE * size:
        raise SceneError(
            f"{file} has no height; a slice lies in the plane of x and y, with y upwards"
        )


def check_facets(file: MeshFile, tagged: TaggedMesh, outer: IntArray) -> None:
    """Raise SceneError if a tagged facet is not one of the `outer` ones, or is tagged twice."""
    for name, facets in tagged.facets.items():
        if not among(facets, outer).all():
            raise SceneError(
                f'{file}: facets tagged "{name}" are not on the outside of {file.body}'
            )
    for one, other in combinations(tagged.facets, 2):
        if among(tagged.facets[other], tagged.facets[one]).any():
            raise SceneError(f'{file}: a facet is tagged "{one}" and "{other}"')


def check_symmetry(file: MeshFile, tagged: TaggedMesh, what: str) -> None:
    """Raise SceneError if facets tagged `symmetry` are not at y = 0, and `what` at y >= 0."""
    if "symmetry" not in tagged.facets:
        return
    if tagged.points.shape[1] == 2:
        raise SceneError(f'{file}: "symmetry" has no meaning in a slice')
    near = TOLERANCE * np.ptp(tagged.points[:, -1])
    across = tagged.points[tagged.facets["symmetry"], 1]
    if abs(across).max() > near or tagged.points[:, 1].min() < -near:
        raise SceneError(
            f'{file}: facets tagged "symmetry" must be at y = 0 and the {what} at y >= 0'
        )


def refuse(file: MeshFile, fault: Fault | None, unit: str) -> None:
    """Raise SceneError for a fault, with its position in the file's `unit`."""
    if fault is not None:
        what, where = fault
        raise SceneError(f"{file}, near {place(where, unit, UNITS[unit], 6)}: {what}")
