"""Graded lines, tensor-product grids on them, and parts of such meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.patches import mesh_patches, rectangle
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, among, outer_facets

ROUNDING = 1e-10  # of a line's length

Lines = NDArray[np.float64]
Chooser = Callable[[Lines], NDArray[np.bool_]]


def graded(length: float, first: float, slope: float, largest: float = math.inf) -> Lines:
    """Grid lines from 0 to `length` with cells of about s(x) = min(first + slope x, largest).

    The lines are evenly spaced in N(x) = integral of dx / s, the number of cells up to x, after
    N(length) is rounded to a whole number (at least 1). Same units for all but `slope`.
    """
    turn = min(max((largest - first) / slope, 0.0), length)
    cells_to_turn = math.log1p(slope * turn / first) / slope
    cells = cells_to_turn + (length - turn) / min(first + slope * turn, largest)
    number = np.linspace(0.0, cells, max(round(cells), 1) + 1)
    growing = first / slope * np.expm1(slope * np.minimum(number, cells_to_turn))
    lines = (
        growing + np.maximum(number - cells_to_turn, 0.0) * largest if turn < length else growing
    )
    lines[-1] = length
    return lines


def tensor_grid(lines: list[Lines], body: str, parts: Mapping[str, Chooser]) -> TaggedMesh:
    """Tensor-product grid on `lines` of x, (y,) z; `parts` choose outer facets by their centres.

    Centres have the shape (n, dim). In 3-D a side at y = 0 is the part `symmetry`.
    """
    x, *y, z = lines
    points, cells = mesh_patches([rectangle(x, z)], y[0] if y else None)
    for axis, line in enumerate(lines):
        points[:, axis] = snapped(points[:, axis], line)
    if y:
        parts = {**parts, "symmetry": lambda centre: centre[:, 1] == 0.0}

    def by_centre(choose: Chooser) -> Chooser:
        return lambda corners: choose(corners.mean(axis=1))

    return with_parts(points, cells, body, {name: by_centre(parts[name]) for name in parts})


def snapped(values: Lines, line: Lines) -> Lines:
    """Values within rounding of a point of the sorted `line` moved to it; others unchanged."""
    nearest = line[np.searchsorted(0.5 * (line[1:] + line[:-1]), values)]
    return np.where(np.abs(values - nearest) <= ROUNDING * (line[-1] - line[0]), nearest, values)


def with_parts(
    points: Lines, cells: IntArray, body: str, parts: Mapping[str, Chooser]
) -> TaggedMesh:
    """Quadrilaterals or hexahedra whose outer facets are chosen by corners (n, corners, dim).

    Empty parts and unused nodes are dropped.
    """
    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 2 ** points.shape[1])
    kind = "quadrilateral" if points.shape[1] == 2 else "hexahedron"
    whole = TaggedMesh(points, kind, cells, {}, body)
    facets = outer_facets(whole)
    corners = points[facets]
    chosen = {
        name: facets[some] for name, choose in parts.items() if (some := choose(corners)).any()
    }
    return whole._replace(facets=chosen)


def with_sides(tagged: TaggedMesh) -> TaggedMesh:
    """The mesh with its unnamed outer facets as `sides`."""
    free = outer_facets(tagged)
    if tagged.facets:
        free = free[~among(free, np.concatenate(list(tagged.facets.values())))]
    return tagged._replace(facets={**tagged.facets, "sides": free}) if len(free) else tagged
