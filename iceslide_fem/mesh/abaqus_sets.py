"""What the names in an input file of Abaqus stand for: sets of elements, sets of nodes, surfaces.

Cards of one name belong together (*ELEMENT with ELSET, *ELSET, *NSET, *SURFACE), before and after
what they name; sets may hold sets. A name in several instances is all of them. Facets are elements
of a lower dimension, the sides that a surface names, and else the outer facets of a set of nodes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.errors import SceneError
from iceslide_fem.mesh.abaqus_cards import Card, items, key
from iceslide_fem.mesh.abaqus_elements import SIDES, is_shell
from iceslide_fem.mesh.named_cells import PARTS, SECOND_ORDER, Block
from iceslide_fem.mesh.tagged import IntArray

_FACETS = {2: "line", 3: "triangle", 4: "quadrilateral"}  # by corners
NONE = np.zeros(0, dtype=np.int64)


class SetCard(NamedTuple):
    """A card that gives a set, the set's name as written, and `members` that it gives by itself
    (numbers of its nodes or elements).
    """

    name: str
    card: Card
    members: list[int]


class Elements(NamedTuple):
    """Elements of one card and instance; `first`: number of the first of them in the model; nodes
    (elements, nodes of one): their numbers in the model, -1 where the file has no such node.
    """

    type: str
    dim: int
    kind: str
    first: int
    nodes: IntArray


class Scope:
    """Where numbers and names hold: an instance, or what stands outside of all."""

    def __init__(
        self,
        sets: Mapping[tuple[str, str], list[SetCard]],
        nodes: IntArray,
        node_ids: IntArray,
        first: int,
    ) -> None:
        """`nodes`: in the model, by their sorted numbers `node_ids` here; `first` element."""
        self.sets, self.first = sets, first
        self.element_ids: list[int] = []
        self._nodes, self._node_ids = nodes, node_ids

    def global_nodes(self, ids: IntArray) -> IntArray:
        """Numbers in the model of nodes by their numbers here, -1 where there are none."""
        if not len(self._nodes):
            return np.full(ids.shape, -1)
        at = np.minimum(np.searchsorted(self._node_ids, ids), len(self._nodes) - 1)
        return np.where(self._node_ids[at] == ids, self._nodes[at], -1)

    def global_elements(self, ids: IntArray) -> IntArray:
        """The same for elements. Raises ValueError where one of them is there twice."""
        own, order = self._sorted_elements
        if not len(own):
            return np.full(ids.shape, -1)
        at = np.minimum(np.searchsorted(own, ids), len(own) - 1)
        return np.where(own[at] == ids, self.first + order[at], -1)

    @cached_property
    def _sorted_elements(self) -> tuple[IntArray, IntArray]:
        ids = np.array(self.element_ids, dtype=np.int64)
        order = np.argsort(ids, kind="stable")
        twice = np.flatnonzero(np.diff(ids[order]) == 0)
        if twice.size:
            raise ValueError(f"element {ids[order][twice[0]]} is there twice")
        return ids[order], order


class Names:
    """All names of a file. What is wrong with a name matters only if the mesh needs it."""

    def __init__(
        self, path: Path, dim: int, body: str, scopes: Mapping[str, Scope], elements: list[Elements]
    ) -> None:
        self._path, self._dim, self._scopes, self._elements = path, dim, scopes, elements
        self._needed = {body, *PARTS}

    def resolved(self) -> tuple[list[Block], dict[str, IntArray]]:
        """Named blocks, and named sets of nodes. Raises SceneError for a name that is needed."""
        blocks: list[Block] = []
        node_sets: dict[str, IntArray] = {}
        for kind, name, written in self._all():
            shown = name if name in self._needed else written
            try:
                if kind == "ELSET":
                    blocks += self._cells(shown, self._joined(kind, name))
                else:
                    facets, nodes = self._surface(kind, name)
                    blocks += [Block(shown, self._dim - 1, form, table) for form, table in facets]
                    if nodes.size:
                        node_sets[shown] = np.union1d(node_sets.get(shown, NONE), nodes)
            except ValueError as error:
                if name in self._needed:
                    raise SceneError(
                        f'rubber.mesh {self._path}: the set "{written}" can\'t be read: {error}'
                    ) from None
        return blocks, node_sets

    def _all(self) -> list[tuple[str, str, str]]:
        """Kind of card, name, name as written; without those that are marked as internal."""
        found = {
            (kind, name): cards[0].name
            for scope in self._scopes.values()
            for (kind, name), cards in scope.sets.items()
            if name and not ("INTERNAL" in cards[0].card.options or name.startswith("_"))
        }
        return [(kind, name, written) for (kind, name), written in found.items()]

    def _holders(self, kind: str, name: str) -> list[list[str]]:
        """Scopes that have the name: the one outside of all instances, and the instances."""
        having = [scope for scope, found in self._scopes.items() if (kind, name) in found.sets]
        return [some for some in ([s for s in having if not s], [s for s in having if s]) if some]

    def _joined(self, kind: str, name: str) -> IntArray:
        """Nodes or elements of all sets of one name."""
        found = [
            np.unique(np.concatenate([self._members(kind, scope, name, ()) for scope in scopes]))
            for scopes in self._holders(kind, name)
        ]
        if len(found) > 1 and not np.array_equal(*found):
            raise ValueError("it is one thing in a part and another one outside of the parts")
        return found[0]

    def _members(self, kind: str, scope: str, name: str, above: tuple[str, ...]) -> IntArray:
        """Numbers in the model of the nodes (NSET) or elements (ELSET) of a set."""
        if name in above:
            raise ValueError(f'the set "{name}" holds itself')
        if (kind, name) not in self._scopes[scope].sets:
            raise ValueError(f'there is no *{kind} "{name}"')
        found = [NONE]
        for _, card, members in self._scopes[scope].sets[kind, name]:
            if members or card.keyword in ("NODE", "ELEMENT"):
                found.append(self._numbered(kind, scope, np.array(members, dtype=np.int64)))
                continue
            inner = card.label("INSTANCE") or scope
            if inner not in self._scopes:
                raise ValueError(f'there is no instance "{inner}"')
            if kind == "NSET" and card.label("ELSET"):
                elements = self._members("ELSET", inner, card.label("ELSET"), ())
                found += [block.nodes.ravel() for block in self._cells("", elements)]
            if "GENERATE" in card.options:
                spans = [[int(item) for item in items(line)] for line in card.data]
                numbers = [np.arange(s[0], s[1] + 1, s[2] if len(s) > 2 else 1) for s in spans]
                found += [self._numbered(kind, inner, span) for span in numbers]
                continue
            words = [word for line in card.data for word in items(line)]
            plain = [int(word) for word in words if word.isdigit()]
            found.append(self._numbered(kind, inner, np.array(plain, dtype=np.int64)))
            for word in words:
                if not word.isdigit():
                    found.append(self._named(kind, inner, word, (*above, name)))
        return np.unique(np.concatenate(found))

    def _named(self, kind: str, scope: str, word: str, above: tuple[str, ...] = ()) -> IntArray:
        """Members of what a word names: a set, or `instance.set` or `instance.number`."""
        owner, dot, rest = word.partition(".")
        if dot and key(owner) in self._scopes and (kind, key(word)) not in self._scopes[scope].sets:
            scope, word, above = key(owner), rest, ()
        if word.isdigit():
            return self._numbered(kind, scope, np.array([int(word)]))
        return self._members(kind, scope, key(word), above)

    def _numbered(self, kind: str, scope: str, ids: IntArray) -> IntArray:
        found = self._scopes[scope]
        places = found.global_nodes(ids) if kind == "NSET" else found.global_elements(ids)
        if (places < 0).any():
            what = "node" if kind == "NSET" else "element"
            raise ValueError(f"{what} {ids[places < 0][0]} is not in the file")
        return places

    def _cells(self, name: str, elements: IntArray) -> list[Block]:
        """Sorted elements as blocks."""
        return [
            Block(name, some.dim, some.kind, some.nodes[rows])
            for some, rows in self._rows(elements)
        ]

    def _rows(self, elements: IntArray) -> list[tuple[Elements, IntArray]]:
        """Sorted elements by the cards that they are on."""
        found = []
        for some in self._elements:
            low, high = np.searchsorted(elements, [some.first, some.first + len(some.nodes)])
            if high > low:
                found.append((some, elements[low:high] - some.first))
        return found

    def _surface(self, kind: str, name: str) -> tuple[list[tuple[str, IntArray]], IntArray]:
        """Facets (kind, corners) and nodes that a *SURFACE or an *NSET names."""
        if kind == "NSET":
            return [], self._joined(kind, name)
        levels = []
        for scopes in self._holders(kind, name):
            parts = [self._sides(scope, name, ()) for scope in scopes]
            facets = [facet for found, _ in parts for facet in found]
            levels.append((facets, np.unique(np.concatenate([nodes for _, nodes in parts]))))
        if len(levels) > 1 and _as_set(levels[0]) != _as_set(levels[1]):
            raise ValueError("it is one thing in a part and another one outside of the parts")
        return levels[0]

    def _sides(
        self, scope: str, name: str, above: tuple[str, ...]
    ) -> tuple[list[tuple[str, IntArray]], IntArray]:
        if name in above:
            raise ValueError(f'the surface "{name}" holds itself')
        if ("SURFACE", name) not in self._scopes[scope].sets:
            raise ValueError(f'there is no *SURFACE "{name}"')
        facets: list[tuple[str, IntArray]] = []
        nodes = NONE
        for _, card, _ in self._scopes[scope].sets["SURFACE", name]:
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
                        more = self._sides(scope, key(one), (*above, name))
                        facets += more[0]
                        nodes = np.union1d(nodes, more[1])
                elif kind == "node":
                    nodes = np.union1d(nodes, self._word("NSET", scope, word))
                else:
                    elements = np.unique(self._word("ELSET", scope, word))
                    side = label[0].upper() if label else ""
                    facets += [self._side(*found, side) for found in self._rows(elements)]
        return facets, nodes

    def _word(self, kind: str, scope: str, word: str) -> IntArray:
        if word.isdigit():
            return self._numbered(kind, scope, np.array([int(word)]))
        return self._named(kind, scope, word)

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
        every = [facets(other) for other in self._elements if other.dim == self._dim]
        flat = [table.reshape(-1, corners) for table in every if table.shape[2] == corners]
        joined = np.sort(np.concatenate([own.reshape(-1, corners), *flat]), axis=1)
        _, number, count = np.unique(joined, axis=0, return_inverse=True, return_counts=True)
        alone = count[number.ravel()[: own.size // corners]] == 2  # here and in `flat`
        return _FACETS[corners], own.reshape(-1, corners)[alone]


def _as_set(found: tuple[list[tuple[str, IntArray]], IntArray]) -> set[tuple[int, ...]]:
    facets, nodes = found
    rows = {tuple(sorted(row)) for _, table in facets for row in table.tolist()}
    return rows | {(node,) for node in nodes.tolist()}
