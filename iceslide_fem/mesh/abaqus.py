"""Meshes in input files of Abaqus and CalculiX (.inp): elements, sets, surfaces, instances.

Numbers and names of nodes, elements and sets are valid in a scope (`scopes_of`).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from functools import cached_property
from itertools import chain, groupby
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from iceslide_fem.mesh.abaqus_cards import (
    SHELLS,
    Card,
    Element,
    items,
    key,
    kind_of,
    real,
    scopes_of,
    span,
    whole,
)
from iceslide_fem.mesh.named_cells import (
    FIRST_ORDER,
    KINDS,
    Block,
    MeshFile,
    NamedCells,
    tagged_mesh,
)
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

_FACET_KINDS = {2: "line", 3: "triangle", 4: "quadrilateral"}  # by nodes


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells that are named as `file.bodies` and all named sets of facets.

    Names are case-insensitive. Raises SceneError if the file is invalid, or as `tagged_mesh`.
    """
    try:
        model = _Model(scopes_of(file.path), file.dim)
    except ValueError as error:
        raise SceneError(f"{file} can't be read as an input file of Abaqus: {error}") from None
    if not model.elements:
        raise SceneError(f"{file} is no input file of Abaqus with a mesh: it has no *ELEMENT")
    needed = {key(name): name for name in (*file.bodies, *file.parts)}
    blocks: list[Block] = []
    node_sets: dict[str, set[int]] = {}
    for (word, name), card in model.names.items():
        hidden = name[:1] in ("", "_") or "INTERNAL" in card.options
        if hidden and name not in needed:
            continue
        written = card.options["NAME" if word == "SURFACE" else word]
        shown = needed.get(name, written)
        try:
            members = model.members(word, name)
        except ValueError as error:
            if name in needed:
                raise SceneError(f'{file}: the set "{written}" can\'t be read: {error}') from None
            continue  # faults of unused sets are ignored
        if word == "ELSET":
            elements = [model.elements[number] for number in members]
            for kind, some in groupby(elements, lambda element: element.kind):
                dim = KINDS[kind].dim if kind in KINDS else 0
                blocks.append(Block(shown, dim, kind, _table(one.nodes for one in some)))
        else:
            facets = members if word == "SURFACE" else [(node,) for node in members]
            for count, some in groupby(sorted(facets, key=len), len):
                if count == 1:
                    node_sets.setdefault(shown, set()).update(*some)
                else:
                    blocks.append(Block(shown, file.dim - 1, _FACET_KINDS[count], _table(some)))
    _check_one_rubber(file, model)
    sets = {name: np.array(sorted(nodes)) for name, nodes in node_sets.items()}
    points = np.array(model.points)
    return tagged_mesh(file, NamedCells(np.arange(len(points)), points, blocks, sets))


def _check_one_rubber(file: MeshFile, model: _Model) -> None:
    """Raise SceneError if the cells of one of `file.bodies` have several materials, or a *TIE."""
    sets = {
        body: set(model.members("ELSET", key(body)))
        for body in file.bodies
        if ("ELSET", key(body)) in model.names
    }
    for body, cells in sets.items():
        others = (sets[other] for other in sets if body == file.bodies[0] != other)
        materials = model.materials(cells.difference(*others))
        if len(materials) > 1:
            raise SceneError(
                f'{file}: "{body}" has sections of several materials ({", ".join(materials)}); '
                "allowed: one, and sets of elements with the names of rubber.layers for the others"
            )
    every = set().union(*sets.values())
    nodes = {node for cell in every for node in model.elements[cell].nodes}
    if ties := model.ties(nodes):
        raise SceneError(
            f"{file}: {file.body} is joined by a *TIE ({ties[0]}), which is not read: mesh both "
            "parts together, so that they share their nodes"
        )


def _table(rows: Any) -> Any:
    return np.array([*rows], dtype=np.int64)


class _Model:
    """Nodes and elements of all scopes in one array, and the names and numbers of each scope.

    dim: dimension of the cells.
    """

    def __init__(self, scopes: dict[str, list[Card]], dim: int) -> None:
        """Read the scopes. Raises ValueError for an invalid card."""
        self.points: list[Array] = []
        self.elements: list[Element] = []
        self._dim, self._scopes = dim, scopes
        self._places: dict[tuple[str, str, int], int] = {}  # by kind of set, scope, number
        self._sets: dict[tuple[str, str, str], list[Card]] = {}  # by kind, scope, name
        for scope, cards in scopes.items():
            self._add_nodes(scope, cards)
            for card in cards:
                if card.keyword == "ELEMENT":
                    self._add_elements(scope, card)
                elif card.keyword in ("NSET", "ELSET", "SURFACE"):
                    name = card.label("NAME" if card.keyword == "SURFACE" else card.keyword)
                    self._sets.setdefault((card.keyword, scope, name), []).append(card)

    @property
    def names(self) -> dict[tuple[str, str], Card]:
        """A card of each kind of set (NSET, ELSET, SURFACE) and name."""
        return {(word, name): cards[0] for (word, _, name), cards in self._sets.items()}

    def members(self, word: str, name: str) -> list[Any]:
        """Nodes (NSET), elements (ELSET) or facets (SURFACE) of all sets of one name.

        Facets are tuples of nodes, with one node for a surface of nodes. Raises ValueError for an
        invalid set.
        """
        having = [scope for scope in self._scopes if (word, scope, name) in self._sets]
        outside, inside = (
            {*chain(*(self._found(word, scope, name, ()) for scope in having if test(scope)))}
            for test in (lambda scope: not scope, bool)
        )
        if having[0] == "" and len(having) > 1 and _unordered(outside) != _unordered(inside):
            raise ValueError("it is one thing in a part and another one outside of the parts")
        return sorted(outside or inside)

    def materials(self, elements: set[int]) -> list[str]:
        """Materials in the sections of any of the `elements`."""
        found = {}
        for scope, card in self._cards("SOLID SECTION"):
            if card.label("ELSET") and not elements.isdisjoint(
                self._found("ELSET", scope, card.label("ELSET"), ())
            ):
                found[card.label("MATERIAL")] = card.options.get("MATERIAL", "")
        return list(found.values())

    def ties(self, nodes: set[int]) -> list[str]:
        """Pairs of surfaces that a *TIE joins, both of them of these `nodes`."""
        pairs = [line for _, card in self._cards("TIE") for line in card.data]
        return [
            pair.strip()
            for pair in pairs
            if all(
                nodes.issuperset(chain(*self._found("SURFACE", "", name, ())))
                for name in items(pair)
            )
        ]

    def _cards(self, keyword: str) -> list[tuple[str, Card]]:
        return [
            (scope, card)
            for scope, cards in self._scopes.items()
            for card in cards
            if card.keyword == keyword
        ]

    def _add_nodes(self, scope: str, cards: list[Card]) -> None:
        nodes: dict[int, tuple[float, ...]] = {}
        for card in cards:
            if card.keyword != "NODE":
                continue
            if card.label("SYSTEM") not in ("", "r"):
                system = card.options["SYSTEM"]
                raise ValueError(f"*NODE, SYSTEM={system}: allowed are Cartesian coordinates")
            rows = [line.split(",") for line in card.data]
            for number, *place in rows:
                at = (*map(real, place), 0.0, 0.0, 0.0)[:3]
                if nodes.setdefault(whole(number), at) != at:
                    raise ValueError(f"node {number} is there twice, at different places")
            self._name("NSET", scope, card, [number for number, *_ in rows])
        numbers = sorted(nodes)
        points = np.array([nodes[number] for number in numbers]).reshape(-1, 3)
        if cards and cards[0].keyword == "INSTANCE":
            points = _placed(points, [[*map(real, items(line))] for line in cards[0].data])
        first = len(self.points)
        self.points.extend(points)
        self._places |= {("NSET", scope, node): first + n for n, node in enumerate(numbers)}

    def _add_elements(self, scope: str, card: Card) -> None:
        """Add elements; an element's lines continue until it has all nodes of its type."""
        type_ = card.options.get("TYPE", "").upper()
        kind = kind_of(type_)
        size = KINDS[kind].nodes if kind in KINDS else 0
        ids: list[str] = []
        row: list[int] = []
        for line in card.data:
            row += map(whole, items(line))
            if len(row) <= size or (not size and line.endswith(",")):
                continue
            number, *nodes = row
            if len(nodes) > size and kind in KINDS and KINDS[kind].dim > 1:
                break
            places = [self._places.get(("NSET", scope, node), -1) for node in nodes[:size]]
            if ("ELSET", scope, number) in self._places:
                raise ValueError(f"element {number} is there twice")
            self._places["ELSET", scope, number] = len(self.elements)
            self.elements.append(Element(type_, kind, tuple(places)))
            ids.append(str(number))
            row = []
        if row and size:
            raise ValueError(
                f"element {row[0]} of type {type_} has {len(row) - 1} nodes, not {size}"
            )
        self._name("ELSET", scope, card, ids)

    def _name(self, word: str, scope: str, card: Card, numbers: list[str]) -> None:
        """Add the set named in a card of nodes or elements, as a separate card."""
        if word in card.options:
            own = Card(word, {word: card.options[word]}, numbers)
            self._sets.setdefault((word, scope, card.label(word)), []).append(own)

    def _found(self, word: str, scope: str, item: str, above: tuple[Any, ...]) -> list[Any]:
        """Members of a name, a number or `instance.name`; above: the enclosing sets."""
        item = key(item)
        owner, dot, rest = item.partition(".")
        if dot and owner in self._scopes and (word, scope, item) not in self._sets:
            return self._found(word, owner, rest, above)
        if item.isdigit() and word != "SURFACE":
            if (word, scope, int(item)) not in self._places:
                what = "node" if word == "NSET" else "element"
                raise ValueError(f"{what} {item} is not in the file")
            return [self._places[word, scope, int(item)]]
        here = (word, scope, item)
        if here in above:
            raise ValueError(f'the set "{item}" holds itself')
        if here not in self._sets:
            raise ValueError(f'there is no *{word} "{item}"')
        of_card: Callable[..., list[Any]] = self._facets if word == "SURFACE" else self._listed
        return [
            found for card in self._sets[here] for found in of_card(scope, card, (*above, here))
        ]

    def _listed(self, scope: str, card: Card, above: tuple[Any, ...]) -> list[int]:
        """Nodes of a *NSET, elements of an *ELSET."""
        scope = card.label("INSTANCE") or scope
        if scope not in self._scopes:
            raise ValueError(f'there is no instance "{scope}"')
        if "GENERATE" in card.options:
            listed = [str(number) for line in card.data for number in span(line)]
        else:
            listed = [item for line in card.data for item in items(line)]
        found = [one for item in listed for one in self._found(card.keyword, scope, item, above)]
        if card.keyword == "NSET" and card.label("ELSET"):
            for element in self._found("ELSET", scope, card.label("ELSET"), ()):
                found += self.elements[element].nodes
        return found

    def _facets(self, scope: str, card: Card, above: tuple[Any, ...]) -> list[tuple[int, ...]]:
        """Facets of a *SURFACE: by element sides, by nodes, or as a union of surfaces."""
        kind, combined = card.label("TYPE") or "element", card.label("COMBINE")
        if kind not in ("element", "node") or combined not in ("", "union"):
            what = f"COMBINE={combined}" if combined else f"TYPE={kind}"
            raise ValueError(
                f"*SURFACE, {what.upper()}: allowed are TYPE=ELEMENT, TYPE=NODE and COMBINE=UNION"
            )
        facets: list[tuple[int, ...]] = []
        for item, *more in filter(None, map(items, card.data)):
            if combined:
                for one in (item, *more):
                    facets += self._found("SURFACE", scope, one, above)
            elif kind == "node":
                facets += [(node,) for node in self._found("NSET", scope, item, ())]
            else:
                for element in self._found("ELSET", scope, item, ()):
                    facets += self._sides(self.elements[element], more[0].upper() if more else "")
        return facets

    def _sides(self, element: Element, side: str) -> list[tuple[int, ...]]:
        """The facet on a side (S1, E1, ...) of an element, or all free facets for ""."""
        if element.kind not in KINDS:
            raise ValueError(f"it has sides of {element.type} cells; {FIRST_ORDER}")
        if element.dim == self._dim - 1 and not side.startswith("E"):
            return [element.nodes]  # SPOS, SNEG
        letters = "E" if re.match(rf"(?:{SHELLS})\d", element.type) else "SE"
        match = re.fullmatch(rf"[{letters}](\d+)", side)
        if element.dim != self._dim or (side and not match):
            raise ValueError(
                f'"{side}" is no side of elements of type {element.type} that is a facet'
            )
        if match is None:
            return [facet for facet in element.sides if self._cells[frozenset(facet)] == 1]
        if not 1 <= int(match[1]) <= len(element.sides):
            raise ValueError(f'elements of type {element.type} have no side "{side}"')
        return [element.sides[int(match[1]) - 1]]

    @cached_property
    def _cells(self) -> Counter[frozenset[int]]:
        """Number of cells of each facet."""
        cells = (element.sides for element in self.elements if element.dim == self._dim)
        return Counter(frozenset(side) for sides in cells for side in sides)


def _unordered(members: set[Any]) -> set[Any]:
    return {frozenset(one) if isinstance(one, tuple) else one for one in members}


def _placed(points: Array, placement: list[list[float]]) -> Array:
    """Points (n, 3) shifted by (x, y, z), then turned around the axis from a to b by an angle:
    (ax, ay, az, bx, by, bz, degrees).
    """
    for row in placement:
        if len(row) <= 3:
            points = points + [*row, 0.0, 0.0, 0.0][:3]
            continue
        start, axis = np.array(row[:3]), np.subtract(row[3:6], row[:3])
        if len(row) != 7 or not axis.any():
            raise ValueError("the rotation of an *INSTANCE needs two points and an angle")
        turn = Rotation.from_rotvec(row[6] * axis / np.linalg.norm(axis), degrees=True)
        points = turn.apply(points - start) + start
    return points
