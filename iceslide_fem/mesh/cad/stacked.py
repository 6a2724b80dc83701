"""Solids whose faces are flat or upright: hexahedra, quadrilaterals of the plan in layers.

The plan is cut by the outlines of all sections. Between two heights of flat faces the section is
the same, and its part of the plan is filled with layers.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import gmsh
import numpy as np

from iceslide_fem.mesh.box import Grading, reference_cells
from iceslide_fem.mesh.cad.cells import is_symmetric, shape_of
from iceslide_fem.mesh.cad.collected import Meshed
from iceslide_fem.mesh.cad.plan import Plan, plan_cells
from iceslide_fem.mesh.cad.solids import across, box_of, tolerance
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, outer_facets
from iceslide_fem.runtime.arrays import Array


def heights(low: Array, high: Array) -> list[float]:
    """Heights of the flat faces, from 0 up; none if a face is neither flat nor upright."""
    near = tolerance(high - low)
    found = [0.0]
    for _, face in gmsh.model.getEntities(2):
        first, last = box_of([(2, face)])
        if last[2] - first[2] < near:
            found.append(0.5 * float(first[2] + last[2]))
        elif not across(face, 2):
            return []
    ordered = np.sort(found)
    return [float(z) for z in ordered[np.diff(ordered, prepend=-1.0) > 2.0 * near]]


def stacked(low: Array, high: Array, levels: Sequence[float], refinement: float) -> Meshed:
    """The solids, or their half y >= 0, by hexahedra; levels: `heights` of flat faces."""
    symmetric = is_symmetric(float(high[2]))
    block = shape_of(low, high, symmetric)
    cells, reach = reference_cells(block, refinement)
    parts = _plan(low, high, levels, symmetric)
    plan = plan_cells(cells[:2], reach, tolerance(high - low), symmetric)
    sized, z, hexahedra = Grading(cells[2], reach, None, 0.0), [0.0], []
    for (bottom, top), part in zip(pairwise(levels), parts, strict=True):
        here = plan.quads[np.isin(plan.face, part)]
        for height in sized.between(bottom, top)[1:]:
            below, above = ((len(z) - 1 + up) * len(plan.points) for up in (0, 1))
            hexahedra.append(np.concatenate([here + below, here + above], axis=1))
            z.append(float(height))
    points = np.tile(plan.points, (len(z), 1))
    points[:, 2] = np.repeat(z, len(plan.points))
    body = TaggedMesh(points, "hexahedron", np.concatenate(hexahedra), {}, "rubber")
    facets = outer_facets(body)
    owner = _owners(facets, plan)
    used, places = np.unique(body.cells, return_inverse=True)
    body = body._replace(points=points[used], cells=places.reshape(body.cells.shape))
    none = np.zeros((0, 3))
    return Meshed(body, np.searchsorted(used, facets), owner, none, none, symmetric)


def _plan(low: Array, high: Array, levels: Sequence[float], symmetric: bool) -> list[list[int]]:
    """Leave the plan in the model, cut by the outlines of all sections; the numbers of the faces
    of each section.
    """
    occ, size = gmsh.model.occ, high - low
    corner, solids = low - size, gmsh.model.getEntities(3)
    if symmetric:
        corner[1] = 0.0
    sections = []
    for bottom, top in pairwise(levels):
        middle = 0.5 * (bottom + top)
        plane = occ.addRectangle(corner[0], corner[1], middle, 3.0 * size[0], 3.0 * size[1])
        found, _ = occ.intersect([(2, plane)], solids, removeTool=False)
        occ.translate(found, 0.0, 0.0, -middle)
        sections.append(found)
    occ.remove(solids, recursive=True)
    every = [face for section in sections for face in section]
    pieces = occ.fragment(every[:1], every[1:])[1] if len(every) > 1 else [every]
    occ.synchronize()
    numbers = iter(pieces)
    return [[number for _ in section for _, number in next(numbers)] for section in sections]


def _owners(facets: IntArray, plan: Plan) -> IntArray:
    """A number for all facets (n, 4) above a curve of the plan, or at a height."""
    count = len(plan.points)
    sides = np.sort(facets % count, axis=1)
    upright = sides[:, 0] == sides[:, 1]
    owner = -1 - facets.min(axis=1) // count
    both = np.concatenate([np.sort(plan.lines, axis=1), sides[upright][:, [0, 2]]])
    _, first, number = np.unique(both, axis=0, return_index=True, return_inverse=True)
    owner[upright] = plan.curve[first[number.ravel()[len(plan.lines) :]]]
    return owner
