"""What gmsh's current model has meshed: cells, outer facets, and the way from these to the CAD."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import gmsh
import numpy as np

from iceslide_fem.mesh.cad.solids import BadCad
from iceslide_fem.mesh.gmsh_model import FACETS, nodes_of
from iceslide_fem.mesh.named_cells import KINDS, Kind
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.arrays import Array

# Facets with nodes in the middles of their edges (and of a quadrilateral), and the corners around
# each of these nodes.
QUADRATIC = {"line": Kind(1, 3, 8), "triangle": Kind(2, 6, 9), "quadrilateral": Kind(2, 9, 10)}
AROUND: dict[str, list[tuple[int, ...]]] = {
    "line": [(0, 1)],
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quadrilateral": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 1, 2, 3)],
}


class Meshed(NamedTuple):
    """The cells; outer facets and the numbers of their CAD faces; middles of these facets and of
    their edges (n, d), and the way from each to the CAD (n, d); symmetric: whether the cells are
    the half y >= 0.
    """

    body: TaggedMesh
    facets: IntArray
    owner: IntArray
    middles: Array
    bulges: Array
    symmetric: bool


def collected(name: str, symmetric: bool, scale: Array) -> Meshed:
    """The mesh of the model of `name` cells, whose coordinates are multiplied by a `scale`.

    The elements in the model become quadratic. Raises BadCad if there are cells of another kind.
    """
    kind = KINDS[name]
    cells = elements(kind, [number for _, number in gmsh.model.getEntities(kind.dim)])[0]
    sides = [
        number for _, number in gmsh.model.getEntities(kind.dim - 1)
        if len(gmsh.model.getAdjacencies(kind.dim - 1, number)[0]) == 1
    ]  # fmt: skip
    facets, owner = elements(KINDS[FACETS[name]], sides)
    if not len(cells):
        raise BadCad("cannot be meshed: no cells are left; raise numerics.refinement")
    points, places = nodes_of(gmsh.model, np.concatenate([cells.ravel(), facets.ravel()]))
    cells, facets = (
        some.reshape(-1, each.shape[1])
        for some, each in zip(np.split(places, [cells.size]), (cells, facets), strict=True)
    )
    body = TaggedMesh(points * scale, name, cells, {}, "rubber")
    return Meshed(body, facets, owner, *_bulges(FACETS[name], sides, scale), symmetric)


def _bulges(name: str, sides: Sequence[int], scale: Array) -> tuple[Array, Array]:
    """Middles of the facets of the `sides` and of their edges, and the ways to the CAD."""
    gmsh.model.mesh.setOrder(2)
    nodes = elements(QUADRATIC[name], sides)[0]
    points, places = nodes_of(gmsh.model, nodes.ravel())
    corners = (points * scale)[places.reshape(nodes.shape)]
    middles = np.stack([corners[:, around].mean(axis=1) for around in AROUND[name]], axis=1)
    bulges = corners[:, KINDS[name].nodes :] - middles
    return middles.reshape(-1, 3), bulges.reshape(-1, 3)


def elements(kind: Kind, entities: Sequence[int]) -> tuple[IntArray, IntArray]:
    """Elements of a kind on entities, (n, corners), and the number of their entity, (n,)."""
    found = [np.zeros((0, kind.nodes), dtype=np.int64)]
    owner = [np.zeros(0, dtype=np.int64)]
    for entity in entities:
        kinds, _, nodes = gmsh.model.mesh.getElements(kind.dim, entity)
        for each, some in zip(kinds, nodes, strict=True):
            if each != kind.gmsh:
                raise BadCad("cannot be meshed by cells of one type; give rubber.step_cells")
            corners = np.asarray(some, dtype=np.int64).reshape(-1, kind.nodes)
            found.append(corners)
            owner.append(np.full(len(corners), entity, dtype=np.int64))
    return np.concatenate(found), np.concatenate(owner)
