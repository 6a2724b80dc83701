"""Tensor-product grids with graded lines (NumPy only)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.gmsh_model import TaggedMesh

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


def tensor_grid(
    lines: list[Lines], body: str, parts: Mapping[str, Chooser], holes: Chooser | None = None
) -> TaggedMesh:
    """Tensor-product grid; `parts` choose outer facets, `holes` cells to leave out, by centres.

    Centres have the shape (n, dim). In 3-D a side at y = 0 is the part `symmetry`.
    """
    dim = len(lines)
    shape = [len(line) for line in lines]
    number = np.arange(math.prod(shape)).reshape(shape)
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, dim)
    cells = _corners(number)
    kept = np.ones(len(cells), dtype=bool)
    if holes is not None:
        kept = ~holes(points[cells].mean(axis=1))
    facets = _outer_facets(number, kept.reshape([n - 1 for n in shape]))
    centre = points[facets].mean(axis=1)
    if dim == 3:
        parts = {**parts, "symmetry": lambda centre: centre[:, 1] == 0.0}
    chosen = {
        name: facets[inside] for name, choose in parts.items() if (inside := choose(centre)).any()
    }
    kind = "quadrilateral" if dim == 2 else "hexahedron"
    used, corners = np.unique(cells[kept], return_inverse=True)
    new = np.zeros(len(points), dtype=np.int64)
    new[used] = np.arange(len(used))
    chosen = {name: new[some] for name, some in chosen.items()}
    return TaggedMesh(points[used], kind, corners.reshape(-1, 2**dim), chosen, body)


def _outer_facets(number: NDArray[np.int64], kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Corner nodes of all facets that have a kept cell on one side only."""
    facets = []
    for axis in range(number.ndim):
        sides = np.moveaxis(
            np.pad(kept, [(int(a == axis),) * 2 for a in range(kept.ndim)]), axis, 0
        )
        outer = sides[1:] != sides[:-1]
        for nodes, some in zip(np.moveaxis(number, axis, 0), outer, strict=True):
            facets.append(_corners(nodes)[some.ravel()])
    return np.concatenate(facets)


def _corners(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Corner nodes (cells, 2**dim) of the cells of a grid of node numbers, in gmsh's order."""
    ends = (slice(None, -1), slice(1, None))
    around = [(0, 0), (1, 0), (1, 1), (0, 1)]
    order: dict[int, list[tuple[int, ...]]] = {
        1: [(0,), (1,)],
        2: [*around],
        3: [(*corner, above) for above in (0, 1) for corner in around],
    }
    corners = [number[tuple(ends[end] for end in corner)] for corner in order[number.ndim]]
    return np.stack([corner.ravel() for corner in corners], axis=-1)
