"""Meshes in input files of Abaqus and CalculiX (.inp): nodes, elements, parts and their instances.

A flat file, a part without instances and each instance of a part number their nodes and elements
for themselves. What a name stands for is found by `abaqus_names`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.abaqus_cards import Card, items, key, read_cards
from iceslide_fem.mesh.abaqus_elements import NODES, shape
from iceslide_fem.mesh.abaqus_names import Names
from iceslide_fem.mesh.abaqus_sets import Elements, Scope, SetCard, Sets
from iceslide_fem.mesh.mesh_file import MeshFile
from iceslide_fem.mesh.named_cells import NamedCells, tagged_mesh
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.errors import SceneError

Floats = NDArray[np.float64]

# They make or move nodes and elements; a mesh without what they make is another one.
_GENERATORS = {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM"}
_GENERATORS |= {"SYMMETRIC MODEL GENERATION"}


class _Template(NamedTuple):
    """A part, or what stands in no part: nodes (number, x, y, z), elements (type, numbers, their
    nodes), sets by kind of card and name.
    """

    nodes: list[tuple[float, ...]]
    elements: list[tuple[str, list[int], list[list[int]]]]
    sets: dict[tuple[str, str], list[SetCard]]
    placement: list[list[float]]

    def copy(self, placement: list[list[float]]) -> _Template:
        sets = {name: [*cards] for name, cards in self.sets.items()}
        return _Template([*self.nodes], [*self.elements], sets, placement)


def load(file: MeshFile) -> TaggedMesh:
    """Read the cells that are named as `file.bodies` and all named sets of facets.

    Names are the same in capitals and small letters. Raises SceneError where the file can't be
    understood, and as `tagged_mesh` does.
    """
    try:
        templates = _templates(file.path)
    except ValueError as error:
        raise SceneError(f"{file} can't be read as an input file of Abaqus: {error}") from None
    if not any(template.elements for template in templates.values()):
        raise SceneError(f"{file} is no input file of Abaqus with a mesh: it has no *ELEMENT")
    places = [_nodes(file, template) for template in templates.values()]
    coordinates = np.concatenate([points for _, points in places])
    elements: list[Elements] = []
    scopes, count, first = {}, 0, 0
    for (name, template), (numbers, _) in zip(templates.items(), places, strict=True):
        here = Scope(template.sets, count + np.arange(len(numbers)), numbers, first)
        for kind, ids, nodes in template.elements:
            own_dim, form = shape(kind)
            table = np.array(nodes, dtype=np.int64).reshape(len(ids), NODES.get(form, 0))
            table = here.global_nodes(table)
            if form == "line3":
                table = _ends_first(table, coordinates)
            elements.append(Elements(kind, own_dim, form, first, table))
            here.element_ids.extend(ids)
            first += len(ids)
        scopes[name] = here
        count += len(numbers)
    blocks, node_sets = Names(file, Sets(scopes, elements)).resolved()
    found = NamedCells(np.arange(count), coordinates, blocks, node_sets)
    return tagged_mesh(file, found)


def _ends_first(lines: IntArray, coordinates: Floats) -> IntArray:
    """Lines of three nodes, the middle one last; Abaqus has it second, other programs last."""
    if not len(lines):
        return lines
    one, two, three = coordinates[lines].swapaxes(0, 1)
    second = np.linalg.norm(two - 0.5 * (one + three), axis=1)
    last = np.linalg.norm(three - 0.5 * (one + two), axis=1)
    return np.where((second < last)[:, None], lines[:, [0, 2, 1]], lines)


def _templates(path: Path) -> dict[str, _Template]:
    """What is in the model, by the instances' names: "" for what stands outside of them."""
    outside = _Template([], [], {}, [])
    parts: dict[str, _Template] = {}
    instances: dict[str, _Template] = {}
    here = outside
    for card in read_cards(path):
        word = card.keyword
        if word in ("END PART", "END INSTANCE"):
            here = outside
        elif word == "PART":
            here = parts.setdefault(card.label("NAME"), _Template([], [], {}, []))
        elif word == "INSTANCE":
            part = parts.get(card.label("PART"))
            if part is None:
                raise ValueError(
                    f"*INSTANCE {card.options.get('NAME', '')} is of the part "
                    f'"{card.options.get("PART", "")}", which is not in the file before it'
                )
            here = instances[card.label("NAME")] = part.copy(_numbers(card))
        elif word == "NODE":
            _add_nodes(card, here)
        elif word == "ELEMENT":
            _add_elements(card, here)
        elif word in ("NSET", "ELSET", "SURFACE"):
            name = card.options.get("NAME" if word == "SURFACE" else word, "")
            here.sets.setdefault((word, key(name)), []).append(SetCard(name, card, []))
        elif word in _GENERATORS:
            raise ValueError(
                f"it makes or moves nodes or elements by *{word}; allowed are those that are "
                "written out (*NODE, *ELEMENT)"
            )
    return {"": outside} | (instances or parts)


def _numbers(card: Card) -> list[list[float]]:
    return [[_real(item) for item in line.split(",") if item.strip()] for line in card.data]


def _real(text: str) -> float:
    """A number as Fortran writes it, 1.5D-3, too; an empty field is 0."""
    try:
        return float(text.upper().replace("D", "E")) if text.strip() else 0.0
    except ValueError:
        raise ValueError(f'"{text.strip()}" is no number') from None


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f'"{text.strip()}" is no number of a node or element') from None


def _add_nodes(card: Card, here: _Template) -> None:
    if card.label("SYSTEM") not in ("", "r"):
        raise ValueError(
            f"*NODE, SYSTEM={card.options['SYSTEM']}: allowed are Cartesian coordinates"
        )
    known = len(here.nodes)
    for line in card.data:
        number, *place = line.split(",")
        x, y, z = ([_real(item) for item in place] + [0.0] * 3)[:3]
        here.nodes.append((_whole(number), x, y, z))
    if "NSET" in card.options:
        numbers = [int(node[0]) for node in here.nodes[known:]]
        name = card.options["NSET"]
        here.sets.setdefault(("NSET", key(name)), []).append(SetCard(name, card, numbers))


def _add_elements(card: Card, here: _Template) -> None:
    """Elements whose lines go on until they have all nodes of their type."""
    kind = card.options.get("TYPE", "").strip().upper()
    dim, form = shape(kind)
    size = 1 + NODES.get(form, 0)
    ids: list[int] = []
    nodes: list[list[int]] = []
    row: list[int] = []
    for line in card.data:
        row += [_whole(item) for item in items(line)]
        goes_on = len(row) < size if dim else line.endswith(",")
        if goes_on:
            continue
        if dim > 1 and len(row) > size:
            raise ValueError(
                f"element {row[0]} of type {kind} has {len(row) - 1} nodes, not {size - 1}"
            )
        ids.append(row[0])
        nodes.append(row[1:size] if dim else [])
        row = []
    if row and dim:
        raise ValueError(
            f"element {row[0]} of type {kind} has {len(row) - 1} nodes, not {size - 1}"
        )
    here.elements.append((kind, ids, nodes))
    if "ELSET" in card.options:
        name = card.options["ELSET"]
        here.sets.setdefault(("ELSET", key(name)), []).append(SetCard(name, card, ids))


def _nodes(file: MeshFile, template: _Template) -> tuple[IntArray, Floats]:
    """Sorted numbers (n,) of nodes, and where they are (n, 3) after the instance's placement."""
    table = np.array(template.nodes, dtype=float).reshape(-1, 4)
    table = np.unique(table, axis=0)  # by number
    numbers = table[:, 0].astype(np.int64)
    twice = np.flatnonzero(np.diff(numbers) == 0)
    if twice.size:
        raise SceneError(f"{file}: node {numbers[twice[0]]} is there twice, at different places")
    points = table[:, 1:]
    shift = next((row for row in template.placement if len(row) <= 3), [])
    points = points + np.array([*shift, 0.0, 0.0, 0.0][:3])
    turn = next((row for row in template.placement if len(row) > 3), None)
    return numbers, points if turn is None else _turned(file, points, turn)


def _turned(file: MeshFile, points: Floats, turn: Sequence[float]) -> Floats:
    """Points turned around the axis from a to b by an angle: (ax, ay, az, bx, by, bz, degrees)."""
    axis = np.array(turn[3:6]) - turn[:3]
    if len(turn) != 7 or not np.linalg.norm(axis) > 0.0:
        raise SceneError(f"{file}: the rotation of an *INSTANCE needs two points and an angle")
    axis, angle = axis / np.linalg.norm(axis), np.radians(turn[6])
    arm = points - turn[:3]
    along = np.outer(arm @ axis, axis)
    return (
        np.array(turn[:3])
        + along
        + np.cos(angle) * (arm - along)
        + np.sin(angle) * np.cross(axis, arm)
    )
