"""Quadrilaterals of a plan: of gmsh, or a grid where all curves are parallel to x or y.

The plan is the faces in gmsh's current model, at z = 0.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import NamedTuple

import gmsh
import numpy as np

from iceslide_fem.mesh.box import Grading, joined
from iceslide_fem.mesh.cad.cells import grade_cells
from iceslide_fem.mesh.cad.collected import elements
from iceslide_fem.mesh.cad.solids import SAME, box_of
from iceslide_fem.mesh.gmsh_model import QUADRILATERALS, nodes_of
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.named_cells import KINDS
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array

MOST = 12  # rectangles between a grid's lines, per face


class Plan(NamedTuple):
    """Points (n, 3), quadrilaterals (m, 4) with the numbers of their faces, and edges on curves
    (k, 2) with the numbers of these.
    """

    points: Array
    quads: IntArray
    face: IntArray
    lines: IntArray
    curve: IntArray


def plan_cells(cells: list[float], reach: float, near: float, symmetric: bool) -> Plan:
    """The plan by cells of the sizes `cells` along x and y that grow over `reach`.

    near: tolerance of positions; symmetric: whether y = 0 is no edge.
    """
    curves = gmsh.model.getEntities(1)
    straight = all(np.ptp(box_of([curve]), axis=0)[:2].min() < near for curve in curves)
    found = _grid(cells, reach, near, symmetric) if straight else None
    return _of_gmsh(cells, reach) if found is None else found


def _ends(curve: int) -> Array:
    """Lower and upper end of a straight curve, (2, 2)."""
    points = gmsh.model.getBoundary([(1, curve)], combined=False, oriented=False)
    places = np.array([gmsh.model.getValue(0, number, []) for _, number in points])[:, :2]
    return np.array([places.min(axis=0), places.max(axis=0)])


def _of_gmsh(cells: list[float], reach: float) -> Plan:
    """Quadrilaterals of gmsh, small at all curves. The model is stretched to cells of one size."""
    stretch = cells[1] / cells[0]
    faces = gmsh.model.getEntities(2)
    gmsh.model.occ.dilate(faces, 0.0, 0.0, 0.0, stretch, 1.0, 1.0)
    gmsh.model.occ.synchronize()
    curves = [number for _, number in gmsh.model.getEntities(1)]
    grade_cells("CurvesList", curves, cells[1], reach, QUADRILATERALS)
    for face in faces:
        gmsh.model.mesh.setRecombine(*face)
    gmsh.model.mesh.generate(2)
    quads, face = elements(KINDS["quadrilateral"], [number for _, number in faces])
    lines, curve = elements(KINDS["line"], curves)
    points, places = nodes_of(gmsh.model, np.concatenate([quads.ravel(), lines.ravel()]))
    quads, lines = places[: quads.size].reshape(-1, 4), places[quads.size :].reshape(-1, 2)
    return Plan(points / [stretch, 1.0, 1.0], quads, face, lines, curve)


def _grid(cells: list[float], reach: float, near: float, symmetric: bool) -> Plan | None:
    """The cells of a grid that lie in faces, with lines through all curves.

    None if lines of some faces would cut too many others, or if a face is not filled.
    """
    faces = gmsh.model.getEntities(2)
    boxes = {number: _ends(number) for _, number in gmsh.model.getEntities(1)}
    corners = np.concatenate(list(boxes.values()))
    (x, columns), (y, rows) = (
        _line(corners[:, axis], Grading(cell, reach, None, 0.0), near, symmetric and axis == 1)
        for axis, cell in enumerate(cells)
    )
    if (len(columns) - 1) * (len(rows) - 1) > MOST * len(faces):
        return None
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((len(x), len(y)))], axis=-1)
    node = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    around = [node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]]
    quads, face = [], []
    for (left, right), (front, back) in product(pairwise(columns), pairwise(rows)):
        middle = [0.5 * (x[left] + x[right]), 0.5 * (y[front] + y[back]), 0.0]
        for _, number in faces:
            if gmsh.model.isInside(2, number, middle):
                some = np.stack([part[left:right, front:back] for part in around], axis=-1)
                quads.append(some.reshape(-1, 4))
                face.append(np.full(len(quads[-1]), number))
    points, quad = points.reshape(-1, 3), np.concatenate(quads or [np.zeros((0, 4), dtype=int)])
    area = np.prod((points[quad[:, 2]] - points[quad[:, 0]])[:, :2], axis=1).sum()
    if abs(area / sum(gmsh.model.occ.getMass(*one) for one in faces) - 1.0) > SAME:
        return None
    edges, curve = [], []
    for number, (low, high) in boxes.items():
        there = ((points[:, :2] > low - near) & (points[:, :2] < high + near)).all(axis=1)
        on = np.flatnonzero(there)  # in order along x and y
        edges.append(np.stack([on[:-1], on[1:]], axis=1))
        curve.append(np.full(len(on) - 1, number))
    return Plan(points, quad, *(np.concatenate(part) for part in (face, edges, curve)))


def _line(at: Array, sized: Grading, near: float, halved: bool) -> tuple[Lines, list[int]]:
    """Lines through all positions `at`, and the places of these; halved: the first is no edge."""
    ends = np.unique(at)
    ends = ends[np.diff(ends, prepend=-np.inf) > near]
    first = [sized.from_plane(ends[0], ends[1])] if halved else []
    parts = first + [sized.between(low, high) for low, high in pairwise(ends[len(first) :])]
    places = np.cumsum([0, *(len(part) - 1 for part in parts)]).tolist()
    return joined(parts), places
