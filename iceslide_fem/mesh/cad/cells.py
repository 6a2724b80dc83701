"""Cells of solids in gmsh's current model: tetrahedra, swept hexahedra, sections of quadrilaterals.

Sizes are those of the built-in block (`box`): EDGE_CELL at horizontal edges, growing by EDGE_SLOPE.
Cells of the built-in block are longer along x than along z. gmsh's sizes have no direction, so the
shape is meshed after its axes are stretched to cells of one size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import gmsh
import numpy as np

from iceslide_fem.mesh.box import EDGE_CELL, EDGE_SLOPE, LARGEST_CELL, box_lines, reference_cells
from iceslide_fem.mesh.cad.collected import Meshed, collected
from iceslide_fem.mesh.cad.solids import BadCad, across, box_of, edges, outer_faces, tolerance
from iceslide_fem.mesh.gmsh_model import QUADRILATERALS, grade
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.runtime.arrays import Array

# Cells of a full circle in a section, and in the end of a sweep: contact points are on the CAD
# anyway. Where sizes jump at round edges a curve may get an odd number of cells: then fewer.
ROUND, ROUND_SWEPT = (36, 24, 8, 0), (8, 0)
SAMPLING = 100  # points of an edge from which distances count
SAME = 1e-5  # of the height: mirrored areas and centroids
_OF_TETRAHEDRA = {"Mesh.Algorithm": 6, "Mesh.Algorithm3D": 10, "Mesh.Optimize": 1}


def is_symmetric(height: float) -> bool:
    """Whether every face has a mirror image in y, by area and centroid."""
    occ = gmsh.model.occ
    faces = [face for _, face in gmsh.model.getEntities(2)]
    size = np.array(
        [[occ.getMass(2, face) / height**2, *np.array(occ.getCenterOfMass(2, face)) / height]
         for face in faces]
    )  # fmt: skip
    other = size * [1.0, 1.0, -1.0, 1.0]
    apart = np.linalg.norm(size[:, None] - other[None], axis=2).min(axis=1)
    return bool(apart.max() < SAME)


def is_swept(low: Array, high: Array) -> bool:
    """Whether the solid is a sweep along y: two flat ends, and all other normals across y."""
    near = tolerance(high - low)
    ends = 0
    for face in outer_faces():
        first, last = box_of([(2, face)])
        if last[1] - first[1] < near:
            if min(abs(first[1] - low[1]), abs(first[1] - high[1])) > near:
                return False
            ends += 1
        elif not across(face, 1):
            return False
    return ends >= 2 and len(gmsh.model.getEntities(3)) == 1


def shape_of(low: Array, high: Array, symmetric: bool, dim: int = 3) -> BlockShape:
    """The box of the solid as a shape, for sizes of cells."""
    sides = [(float(low[0]), float(high[0]))]
    if dim == 3:
        sides.append((0.0 if symmetric else float(low[1]), float(high[1])))
    return BlockShape(sides, float(high[2]), symmetric)


def tetrahedra(low: Array, high: Array, refinement: float) -> Meshed:
    """The solids, or their half y >= 0, by tetrahedra."""
    occ, height = gmsh.model.occ, float(high[2])
    symmetric = is_symmetric(height)
    if symmetric:
        size = high - low
        corner = low[0] - size[0], 0.0, -size[2]
        half = occ.addBox(*corner, *(3.0 * size))
        occ.intersect(gmsh.model.getEntities(3), [(3, half)])
        occ.synchronize()
    cells, reach = reference_cells(shape_of(low, high, symmetric), refinement)
    stretch = cells[-1] / np.array(cells)
    try:
        occ.dilate(gmsh.model.getEntities(3), 0.0, 0.0, 0.0, *stretch)
        occ.synchronize()
    except Exception:  # OpenCASCADE cannot stretch tips of cones and poles of some spheres
        stretch, cells = np.ones(3), cells[:1]
    near = tolerance(height)
    curves = []
    for entity in edges():
        first, last = box_of([entity])
        on_plane = symmetric and max(abs(first[1]), abs(last[1])) < near
        if last[2] - first[2] < near and not on_plane:
            curves.append(entity[1])
    grade_cells("CurvesList", curves, cells[-1], reach, _OF_TETRAHEDRA)
    gmsh.model.mesh.generate(3)
    return collected("tetrahedron", symmetric, 1.0 / stretch)


def hexahedra(low: Array, high: Array, refinement: float) -> Meshed:
    """A sweep along y, or its half y >= 0, by hexahedra: quadrilaterals of its end in layers."""
    occ = gmsh.model.occ
    symmetric = is_symmetric(float(high[2]))
    block = shape_of(low, high, symmetric)
    cells, reach = reference_cells(block, refinement)
    near = tolerance(high - low)
    ends = [
        (2, face) for face in outer_faces()
        if all(abs(one[1] - high[1]) < near for one in box_of([(2, face)]))
    ]  # fmt: skip
    occ.remove(gmsh.model.getEntities(3))
    others = [face for face in gmsh.model.getEntities(2) if face not in ends]
    occ.remove(others, recursive=True)
    stretch = np.array([cells[-1] / cells[0], 1.0, 1.0])
    occ.dilate(ends, 0.0, 0.0, 0.0, *stretch)
    lines = high[1] - box_lines(block, refinement)[1][::-1]  # from the end
    layers = ((lines - lines[0]) / (lines[-1] - lines[0]))[1:]
    far = -float(lines[-1] - lines[0])
    occ.extrude(ends, 0.0, far, 0.0, [1] * len(layers), layers.tolist(), recombine=True)
    occ.synchronize()
    corners = [point for _, point in gmsh.model.getBoundary(ends, oriented=False, recursive=True)]
    grade_cells("PointsList", corners, cells[-1], reach, QUADRILATERALS)
    for end in ends:
        gmsh.model.mesh.setRecombine(*end)
    _generate(3, ROUND_SWEPT)
    return collected("hexahedron", symmetric, 1.0 / stretch)


def section(low: Array, high: Array, at: float, refinement: float) -> Meshed:
    """The section at y = `at` by quadrilaterals, points (x, z). Raises BadCad outside the ice."""
    occ, size = gmsh.model.occ, high - low
    planes = _touching(float(size.max()))
    plane = occ.addRectangle(low[0] - size[0], low[2] - size[2], 0.0, 3.0 * size[0], 3.0 * size[2])
    occ.rotate([(2, plane)], 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5 * np.pi)
    occ.translate([(2, plane)], 0.0, at, 0.0)
    occ.intersect(gmsh.model.getEntities(3), [(2, plane)])
    occ.synchronize()
    faces = gmsh.model.getEntities(2)
    if not faces:
        raise BadCad(
            f"has nothing at rubber.step_plane = {at:.6g} mm; allowed: {low[1]:.6g} to "
            f"{high[1]:.6g} mm"
        )
    first, last = box_of(faces)
    near = tolerance(size)
    if first[2] > near:
        raise BadCad(
            f"is {first[2]:.4g} mm above the ice at rubber.step_plane = {at:.6g} mm, in a groove "
            f"or a round edge; allowed: a plane that touches the ice, {planes}"
        )
    cells, reach = reference_cells(shape_of(first, last, False, 2), refinement)
    stretch = np.array([cells[-1] / cells[0], 1.0, 1.0])
    occ.dilate(faces, 0.0, 0.0, 0.0, *stretch)
    occ.synchronize()
    corners = [point for _, point in gmsh.model.getEntities(0)]
    grade_cells("PointsList", corners, cells[-1], reach, QUADRILATERALS)
    for face in faces:
        gmsh.model.mesh.setRecombine(*face)
    _generate(2, ROUND)
    found = collected("quadrilateral", False, 1.0 / stretch)
    flat = [part[..., [0, 2]] for part in (found.body.points, found.middles, found.bulges)]
    body = found.body._replace(points=flat[0])
    return found._replace(body=body, middles=flat[1], bulges=flat[2])


def _touching(size: float) -> str:
    """Where the flat lowest faces are across the slide, in words."""
    near, ends = tolerance(size), []
    for face in outer_faces():
        first, last = box_of([(2, face)])
        if last[2] < near:
            ends.append((round(float(first[1]), 4), round(float(last[1]), 4)))
    merged: list[list[float]] = []
    for low, high in sorted(ends):
        if merged and low <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], high)
        else:
            merged.append([low, high])
    return " or ".join(f"from {low:g} to {high:g} mm" for low, high in merged)


def _generate(dim: int, circles: Sequence[int]) -> None:
    """Mesh the model with the first of these numbers of cells of a circle that gmsh can."""
    for cells in circles:
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", cells)
        try:
            gmsh.model.mesh.generate(dim)
            return
        except Exception:  # gmsh raises nothing more specific
            if cells == circles[-1]:
                raise
            gmsh.model.mesh.clear()


def grade_cells(
    kind: str, entities: Sequence[int], cell: float, reach: float, options: Mapping[str, int]
) -> None:
    """Sizes of cells by the distance to curves or points (`gmsh_model.grade`)."""
    smallest = EDGE_CELL * cell
    sizes = smallest, EDGE_SLOPE * smallest / reach, LARGEST_CELL * cell
    more = {"General.NumThreads": 1, **options}
    grade(gmsh.model, kind, entities, sizes, SAMPLING, more)
