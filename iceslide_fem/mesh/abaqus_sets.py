"""Sets of nodes and elements in an input file of Abaqus, and the scopes in which their names hold.

Cards of one name belong together (*ELEMENT and *NODE with a set, *ELSET, *NSET), before and after
what they name; sets may hold sets. A name in several instances is all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from iceslide_fem.mesh.abaqus_cards import Card, items, key
from iceslide_fem.mesh.named_cells import Block
from iceslide_fem.mesh.tagged import IntArray

NONE = np.zeros(0, dtype=np.int64)

Above = tuple[tuple[str, str], ...]  # scopes and names of the sets that a set is in


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


class Sets:
    """Sets of nodes (NSET) and of elements (ELSET) by scope and name."""

    def __init__(self, scopes: Mapping[str, Scope], elements: list[Elements]) -> None:
        self.scopes, self.elements = scopes, elements

    def holders(self, kind: str, name: str) -> list[list[str]]:
        """Scopes that have the name: the one outside of all instances, and the instances."""
        having = [scope for scope, found in self.scopes.items() if (kind, name) in found.sets]
        levels = [[scope for scope in having if bool(scope) == inner] for inner in (False, True)]
        return [level for level in levels if level]

    def joined(self, kind: str, name: str) -> IntArray:
        """Nodes or elements of all sets of one name."""
        found = [
            np.unique(np.concatenate([self._members(kind, scope, name, ()) for scope in scopes]))
            for scopes in self.holders(kind, name)
        ]
        if len(found) > 1 and not np.array_equal(found[0], found[1]):
            raise ValueError("it is one thing in a part and another one outside of the parts")
        return found[0]

    def _members(self, kind: str, scope: str, name: str, above: Above) -> IntArray:
        """Numbers in the model of the nodes (NSET) or elements (ELSET) of a set."""
        if (scope, name) in above:
            raise ValueError(f'the set "{name}" holds itself')
        if (kind, name) not in self.scopes[scope].sets:
            raise ValueError(f'there is no *{kind} "{name}"')
        found = [NONE]
        for _, card, members in self.scopes[scope].sets[kind, name]:
            if members or card.keyword in ("NODE", "ELEMENT"):
                found.append(self._numbered(kind, scope, np.array(members, dtype=np.int64)))
                continue
            inner = card.label("INSTANCE") or scope
            if inner not in self.scopes:
                raise ValueError(f'there is no instance "{inner}"')
            if kind == "NSET" and card.label("ELSET"):
                elements = self._members("ELSET", inner, card.label("ELSET"), ())
                found += [block.nodes.ravel() for block in self.cells("", elements)]
            if "GENERATE" in card.options:
                found += [self._numbered(kind, inner, _span(line)) for line in card.data]
                continue
            words = [word for line in card.data for word in items(line)]
            plain = [int(word) for word in words if word.isdigit()]
            found.append(self._numbered(kind, inner, np.array(plain, dtype=np.int64)))
            for word in words:
                if not word.isdigit():
                    found.append(self._named(kind, inner, word, (*above, (scope, name))))
        return np.unique(np.concatenate(found))

    def _named(self, kind: str, scope: str, word: str, above: Above = ()) -> IntArray:
        """Members of what a word names: a set, or `instance.set` or `instance.number`."""
        scope, word = self.placed(kind, scope, word)
        if word.isdigit():
            return self._numbered(kind, scope, np.array([int(word)]))
        return self._members(kind, scope, word, above)

    def placed(self, kind: str, scope: str, word: str) -> tuple[str, str]:
        """Scope and name (or number) of what a word stands for: of `instance.name` the instance."""
        owner, dot, rest = word.partition(".")
        if dot and key(owner) in self.scopes and (kind, key(word)) not in self.scopes[scope].sets:
            return key(owner), key(rest)
        return scope, key(word)

    def _numbered(self, kind: str, scope: str, ids: IntArray) -> IntArray:
        found = self.scopes[scope]
        places = found.global_nodes(ids) if kind == "NSET" else found.global_elements(ids)
        if (places < 0).any():
            what = "node" if kind == "NSET" else "element"
            raise ValueError(f"{what} {ids[places < 0][0]} is not in the file")
        return places

    def cells(self, name: str, elements: IntArray) -> list[Block]:
        """Sorted elements as blocks."""
        return [
            Block(name, some.dim, some.kind, some.nodes[rows]) for some, rows in self.rows(elements)
        ]

    def rows(self, elements: IntArray) -> list[tuple[Elements, IntArray]]:
        """Sorted elements by the cards that they are on."""
        found = []
        for some in self.elements:
            low, high = np.searchsorted(elements, [some.first, some.first + len(some.nodes)])
            if high > low:
                found.append((some, elements[low:high] - some.first))
        return found

    def word(self, kind: str, scope: str, word: str) -> IntArray:
        if word.isdigit():
            return self._numbered(kind, scope, np.array([int(word)]))
        return self._named(kind, scope, word)


def _span(line: str) -> IntArray:
    """The numbers that a line of GENERATE gives: first, last, and (or 1) by how much they grow."""
    numbers = [int(item) for item in items(line) if item.lstrip("-").isdigit()]
    if len(numbers) not in (2, 3) or 0 in numbers[2:] or len(numbers) != len(items(line)):
        raise ValueError(f'GENERATE takes first, last and increment, not "{line}"')
    first, last, step = [*numbers, 1][:3]
    return np.arange(first, last + (1 if step > 0 else -1), step)
