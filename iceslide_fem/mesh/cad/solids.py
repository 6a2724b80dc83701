"""Solids of a CAD file in gmsh's current model: read, joined, turned, and refused with a reason."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import gmsh
import numpy as np

from iceslide_fem.runtime.arrays import Array

Entity = tuple[int, int]  # dimension and number

AXES = {
    "x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0), "-z": (0.0, 0.0, -1.0),
}  # fmt: skip
LEAST_HEAL = 1e-6  # mm: gaps that are rounding
HEALS = 1e-3, 1e-2, 0.1  # mm, tried to name the gap of a file whose faces do not close
SAME = 1e-6  # relative tolerance of volumes and areas
SHORTEST = 1e-6  # of the largest side: edges that can be meshed
FLAT = 1e-5  # of the largest side: tolerance of a flat face
UPRIGHT = 1e-6  # component of a normal
LOOSE = 2e-6  # gmsh's enlargement of bounding boxes
TIE = 1e-3  # of the larger surplus of flat area


class BadCad(Exception):
    """What is wrong with a file, in words that follow its name."""


def read_solids(path: Path, heal: float) -> dict[Entity, str]:
    """Solids of a file that share their common faces, and their names in it, "" without one.

    Lengths are mm, those of BREP as they are. heal: gaps of faces (mm) that are closed. Raises
    BadCad.
    """
    occ = gmsh.model.occ
    # OpenCASCADE reads IGES in mm; its target unit is one of STEP.
    step = path.suffix.lower() in (".step", ".stp")
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM" if step else "")
    try:
        occ.importShapes(str(path), highestDimOnly=True)
    except Exception:  # gmsh says only that it could not read the file
        raise BadCad("cannot be read as CAD: it is empty, cut off, or another format") from None
    occ.synchronize()
    if not gmsh.model.getEntities():
        raise BadCad("has no shape: it is empty or cut off")
    before = _volume()
    if heal or not gmsh.model.getEntities(3):
        _close(max(heal, LEAST_HEAL))
    if not gmsh.model.getEntities(3):
        for tolerance in HEALS:
            _close(tolerance)
            if gmsh.model.getEntities(3):
                raise BadCad(
                    f'has faces that do not close: rubber.step_heal = "{1e3 * tolerance:g} um" '
                    "closes its gaps"
                )
        raise BadCad("has no solid: its faces do not close, one may be missing")
    if heal and before and abs(_volume() - before) > 1e-3 * before:
        raise BadCad(
            f"has {_volume():.6g} mm3 after gaps are closed and {before:.6g} mm3 before; allowed: "
            "a smaller rubber.step_heal"
        )
    if any(occ.getMass(*solid) <= 0.0 for solid in gmsh.model.getEntities(3)):
        raise BadCad("has a solid without volume: its faces cut each other or point inwards")
    solids = _joined()
    _refuse_what_has_no_cells()
    return solids


def _refuse_what_has_no_cells() -> None:
    """Raise BadCad if faces cut each other, or an edge is too short for cells."""
    occ, faces = gmsh.model.occ, gmsh.model.getEntities(2)
    copies = occ.copy(faces)
    pieces, _ = occ.fragment(copies[:1], copies[1:])
    occ.remove(pieces, recursive=True)
    if len(pieces) > len(faces):
        raise BadCad("has faces that cut each other; allowed: a solid that does not meet itself")
    low, high = box_of(gmsh.model.getEntities(3))
    for edge in edges():
        length = occ.getMass(*edge)
        if length < SHORTEST * (high - low).max():
            where = ", ".join(f"{value:.4g}" for value in np.mean(box_of([edge]), axis=0))
            raise BadCad(
                f"has an edge of {length:.2g} mm at ({where}) mm, too short for cells: "
                'rubber.step_heal = "1 um" removes it'
            )


def _close(tolerance: float) -> None:
    """Close gaps of faces up to a `tolerance` (mm)."""
    fixed = {"fixDegenerated": True, "fixSmallEdges": True, "fixSmallFaces": True}
    try:
        gmsh.model.occ.healShapes(tolerance=tolerance, sewFaces=True, makeSolids=True, **fixed)
    except Exception as error:  # gmsh raises nothing more specific
        raise BadCad(f"cannot be mended: {' '.join(str(error).split())}") from None
    gmsh.model.occ.synchronize()


def _volume() -> float:
    return float(sum(gmsh.model.occ.getMass(*solid) for solid in gmsh.model.getEntities(3)))


def _joined() -> dict[Entity, str]:
    """The solids with common faces, and their names. Raises BadCad if they overlap or do not
    touch.
    """
    solids = gmsh.model.getEntities(3)
    names = [gmsh.model.getEntityName(*solid).rpartition("/")[2] for solid in solids]
    if len(solids) == 1:
        return dict(zip(solids, names, strict=True))
    before = _volume()
    _, pieces = gmsh.model.occ.fragment(solids[:1], solids[1:])
    gmsh.model.occ.synchronize()
    after, solids = _volume(), gmsh.model.getEntities(3)
    if abs(after - before) > SAME * before:
        raise BadCad(
            f"has solids that overlap: they have {before:.6g} mm3 one by one and {after:.6g} mm3 "
            "together"
        )
    bodies = {number: {number} for _, number in solids}
    for _, face in gmsh.model.getEntities(2):
        sides, _ = gmsh.model.getAdjacencies(2, face)
        together = set().union(*(bodies[int(side)] for side in sides)) if len(sides) else set()
        for number in together:
            bodies[number] = together
    if len({id(body) for body in bodies.values()}) > 1:
        raise BadCad(f"has {len(solids)} solids that do not touch; allowed: one body")
    of_piece = {piece: name for some, name in zip(pieces, names, strict=True) for piece in some}
    return {solid: of_piece.get(solid, "") for solid in solids}


def outer_faces() -> list[int]:
    """Numbers of the faces with a solid on one side only."""
    return [
        face
        for _, face in gmsh.model.getEntities(2)
        if len(gmsh.model.getAdjacencies(2, face)[0]) == 1
    ]


def across(face: int, axis: int) -> bool:
    """Whether all normals of a face are perpendicular to an axis (0, 1, 2)."""
    begin, end = gmsh.model.getParametrizationBounds(2, face)
    for u in np.linspace(0.1, 0.9, 5):
        for v in np.linspace(0.1, 0.9, 5):
            place = [begin[0] + u * (end[0] - begin[0]), begin[1] + v * (end[1] - begin[1])]
            if abs(gmsh.model.getNormal(face, place)[axis]) > UPRIGHT:
                return False
    return True


def edges() -> list[Entity]:
    """All edges with a length; the tip of a cone is one without, of no known type."""
    return [edge for edge in gmsh.model.getEntities(1) if gmsh.model.getType(*edge) != "Unknown"]


def tolerance(size: Array | float) -> float:
    """Within which positions are the same in solids of this size, or these sizes, file units."""
    return FLAT * float(np.max(size)) + LOOSE


def box_of(entities: Sequence[Entity]) -> tuple[Array, Array]:
    """Lower and upper corner of the box around entities, file units."""
    boxes = np.array([gmsh.model.getBoundingBox(*one) for one in entities])
    return boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)


def flat_ends(heal: float) -> dict[str, float]:
    """Area of the flat faces at each end of the box, by the direction outwards.

    heal: width of gaps that are closed, by which boxes are larger.
    """
    low, high = box_of(gmsh.model.getEntities(3))
    near = tolerance(high - low) + 2.0 * heal
    ends = dict.fromkeys(AXES, 0.0)
    for face in outer_faces():
        first, last = box_of([(2, face)])
        area = gmsh.model.occ.getMass(2, face)
        for i, name in enumerate("xyz"):
            if last[i] - first[i] < near:
                for sign, end in (("", high), ("-", low)):
                    if abs(first[i] - end[i]) < near:
                        ends[sign + name] += area
    return ends


def found_up(heal: float) -> tuple[str, str]:
    """The end with the largest surplus of flat area over the other one, and why; z if it is a
    tie.
    """
    ends = flat_ends(heal)
    surplus = {name: area - ends[_opposite(name)] for name, area in ends.items()}
    best = max(surplus, key=lambda name: surplus[name])
    if surplus[best] <= TIE * max(ends.values()):
        return "z", "both ends are alike"
    return best, "the larger flat end"


def _opposite(axis: str) -> str:
    return axis.removeprefix("-") if axis.startswith("-") else f"-{axis}"


def placed(solids: Sequence[Entity], up: str, along: str, heal: float) -> tuple[Array, Array]:
    """Turn the solids so that `up` is z and `along` is x; the lowest point and the middle are at 0.

    Returns the corners of their box. Raises BadCad if the axes are parallel or the top is not flat.
    """
    occ, z, x = gmsh.model.occ, np.array(AXES[up]), np.array(AXES[along])
    y = np.cross(z, x)
    if not y.any():
        raise BadCad(
            f'cannot be turned: rubber.step_up = "{up}" and rubber.step_along = "{along}" are one '
            "axis"
        )
    turn = np.array([x, y, z])
    angle = float(np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)))
    if angle > 1e-9:
        around = np.array(
            [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        )
        if np.linalg.norm(around) < 1e-9:  # half a turn
            around = np.linalg.eigh(0.5 * (turn + turn.T))[1][:, -1]
        occ.rotate(solids, 0.0, 0.0, 0.0, *(around / np.linalg.norm(around)), angle)
        occ.synchronize()
    low, high = box_of(gmsh.model.getEntities(3))
    middle = 0.5 * (low + high)
    occ.translate(gmsh.model.getEntities(3), -middle[0], -middle[1], -low[2])
    occ.synchronize()
    low, high = box_of(gmsh.model.getEntities(3))
    if not flat_ends(heal)["z"]:
        raise BadCad(
            f"has no flat top at its end {up}, where the plate is: its highest point is "
            f"{high[2] - low[2]:.6g} mm above the lowest; allowed: a flat end, or rubber.step_up"
        )
    return low, high
