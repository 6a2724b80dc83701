"""What the names in an input file of Abaqus stand for: cells, facets, sets of nodes.

Facets are elements of a lower dimension, the sides that a surface names, and else the outer facets
of a set of nodes.
"""

from __future__ import annotations

import re

import numpy as np

from iceslide_fem.mesh.abaqus_cards import items, key
from iceslide_fem.mesh.abaqus_elements import SIDES, is_shell
from iceslide_fem.mesh.abaqus_sets import NONE, Above, Elements, Sets
from iceslide_fem.mesh.mesh_file import MeshFile
from iceslide_fem.mesh.named_cells import SECOND_ORDER, Block
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.errors import SceneError

_FACETS = {2: "line", 3: "triangle", 4: "quadrilateral"}  # by corners


class Names:
    """All names of a file. What is wrong with a name matters only if the mesh needs it."""

    def __init__(self, file: MeshFile, sets: Sets) -> None:
        self._file, self._dim, self._sets = file, file.dim, sets
        self._needed = {key(name): name for name in (*file.bodies, *file.parts)}

    def resolved(self) -> tuple[list[Block], dict[str, IntArray]]:
        """Named blocks, and named sets of nodes. Raises SceneError for a name that is needed."""
        blocks: list[Block] = []
        node_sets: dict[str, IntArray] = {}
        for kind, name, written in self._all():
            shown = self._needed.get(name, written)
            try:
                if kind == "ELSET":
                    blocks += self._sets.cells(shown, self._sets.joined(kind, name))
                else:
                    facets, nodes = self._surface(kind, name)
                    blocks += [Block(shown, self._dim - 1, form, table) for form, table in facets]
                    if nodes.size:
                        node_sets[shown] = np.union1d(node_sets.get(shown, NONE), nodes)
            except ValueError as error:
                if name in self._needed:
                    raise SceneError(
                        f'{self._file}: the set "{written}" can\'t be read: {error}'
                    ) from None
        return blocks, node_sets

    def _all(self) -> list[tuple[str, str, str]]:
        """Kind of card, name, name as written; internal ones only if the mesh needs them."""
        found = {
            (kind, name): cards[0].name
            for scope in self._sets.scopes.values()
            for (kind, name), cards in scope.sets.items()
            if name in self._needed
            or (name[:1] not in ("", "_") and "INTERNAL" not in cards[0].card.options)
        }
        return [(kind, name, written) for (kind, name), written in found.items()]

    def _surface(self, kind: str, name: str) -> tuple[list[tuple[str, IntArray]], IntArray]:
        """Facets (kind, corners) and nodes that a *SURFACE or an *NSET names."""
        if kind == "NSET":
            return [], self._sets.joined(kind, name)
        levels = []
        for scopes in self._sets.holders(kind, name):
            parts = [self._sides(scope, name, ()) for scope in scopes]
            facets = [facet for found, _ in parts for facet in found]
            levels.append((facets, np.unique(np.concatenate([nodes for _, nodes in parts]))))
        if len(levels) > 1 and _as_set(levels[0]) != _as_set(levels[1]):
            raise ValueError("it is one thing in a part and another one outside of the parts")
        return levels[0]

    def _sides(
        self, scope: str, name: str, above: Above
    ) -> tuple[list[tuple[str, IntArray]], IntArray]:
        if (scope, name) in above:
            raise ValueError(f'the surface "{name}" holds itself')
        if ("SURFACE", name) not in self._sets.scopes[scope].sets:
            raise ValueError(f'there is no *SURFACE "{name}"')
        facets: list[tuple[str, IntArray]] = []
        nodes = NONE
        for _, card, _ in self._sets.scopes[scope].sets["SURFACE", name]:
            kind, combined = card.label("TYPE") or "element", card.label("COMBINE")
            if kind not in ("element", "node") or combined not in ("", "union"):
                what = f"COMBINE={combined}" if combined else f"TYPE={kind}"
                raise ValueError(
                    f"*SURFACE, {what.upper()}: allowed are TYPE=ELEMENT, TYPE=NODE and "
                    "COMBINE=UNION"
                )
            for word, *label in filter(None, map(items, card.data)):
                if combined:
                    for one in (word, *label):
                        inner = self._sets.placed("SURFACE", scope, one)
                        more = self._sides(*inner, (*above, (scope, name)))
                        facets += more[0]
                        nodes = np.union1d(nodes, more[1])
                elif kind == "node":
                    nodes = np.union1d(nodes, self._sets.word("NSET", scope, word))
                else:
                    elements = np.unique(self._sets.word("ELSET", scope, word))
                    side = label[0].upper() if label else ""
                    facets += [self._side(*found, side) for found in self._sets.rows(elements)]
        return facets, nodes

    def _side(self, some: Elements, rows: IntArray, side: str) -> tuple[str, IntArray]:
        """Kind and corners of the facets on a side ("" for all outer ones) of elements."""
        if some.dim == self._dim - 1 and not side.startswith("E"):
            return some.kind, some.nodes[rows]
        sides = SIDES.get(SECOND_ORDER.get(some.kind, some.kind), [])
        names = ["E"] if is_shell(some.type) else ["S", "E"]
        number = int(match[2]) if (match := re.fullmatch(r"([SE])(\d+)", side)) else 0
        if some.dim != self._dim or (side and not (match and match[1] in names)):
            raise ValueError(f'"{side}" is no side of elements of type {some.type} that is a facet')
        if not side:
            return self._free(some, rows)
        if not 1 <= number <= len(sides):
            raise ValueError(f'elements of type {some.type} have no side "{side}"')
        return _FACETS[len(sides[0])], some.nodes[rows][:, sides[number - 1]]

    def _free(self, some: Elements, rows: IntArray) -> tuple[str, IntArray]:
        """The facets of elements that they share with no other."""

        def facets(of: Elements) -> IntArray:
            sides = SIDES.get(SECOND_ORDER.get(of.kind, of.kind), [(0,)])
            return of.nodes[:, np.array(sides)]

        own = facets(some)[rows]
        corners = own.shape[2]
        every = [facets(other) for other in self._sets.elements if other.dim == self._dim]
        flat = [table.reshape(-1, corners) for table in every if table.shape[2] == corners]
        joined = np.sort(np.concatenate([own.reshape(-1, corners), *flat]), axis=1)
        _, number, count = np.unique(joined, axis=0, return_inverse=True, return_counts=True)
        alone = count[number.ravel()[: own.size // corners]] == 2  # here and in `flat`
        return _FACETS[corners], own.reshape(-1, corners)[alone]


def _as_set(found: tuple[list[tuple[str, IntArray]], IntArray]) -> set[tuple[int, ...]]:
    facets, nodes = found
    rows = {tuple(sorted(row)) for _, table in facets for row in table.tolist()}
    return rows | {(node,) for node in nodes.tolist()}
