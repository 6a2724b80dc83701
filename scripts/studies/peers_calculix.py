"""The cube of `peers` as an input of CalculiX (`ccx`), and what it answers.

The rubber is hyperelastic at finite strain. The ice is one undeformable element that stands below
the cube or is drawn along; the rubber's lower faces meet it surface to surface with a penalty. All
nodes of the plate go down together under its force. Units of the input: mm, N, MPa.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MooneyRivlin
from scripts.studies.common import processor_seconds

# Edges of cells with a node in the middle, and faces, both in CalculiX's order.
EDGES = {
    "hexahedron": "01 12 23 30 45 56 67 74 04 15 26 37",
    "tetrahedron": "01 12 02 03 13 23",
}
FACES = {
    "hexahedron": ["0123", "4567", "0154", "1265", "2376", "3047"],
    "tetrahedron": ["012", "031", "132", "230"],
}
# Slip (mm) after which friction is fully mobilised under the mean pressure, the way of the ice that
# draws it on (a few times what the cube gives way), its size, and the first step of the load.
MOBILISED, WAY, ICE, FIRST = 2e-2, 0.4, 3.0, 0.2


class Answer(NamedTuple):
    """How far the plate goes down (m, NaN if there is no answer), unknowns, processor seconds."""

    displacement: float
    unknowns: int
    seconds: float


class Cube(NamedTuple):
    """A half cube of an element of CalculiX: its mesh, `pressure` in Pa, `penalty` in Pa/m; under a
    friction coefficient `mu` the ice is drawn along."""

    mesh: TaggedMesh
    element: str
    material: MooneyRivlin
    pressure: float
    mu: float
    penalty: float


def written(cube: Cube) -> tuple[str, int]:
    """Input for the cube, and the number of its unknowns."""
    mesh, element, material, pressure, mu, penalty = cube
    points, cells = mesh.points * 1e3, mesh.cells
    if not element.startswith("C3D8"):
        points, cells = with_middles(points, cells, mesh.cell_type)
    top, height = points[:, 2].max(), np.ptp(points[:, 2])
    plate = np.flatnonzero(np.isclose(points[:, 2], top)) + 1
    symmetry = np.setdiff1d(np.flatnonzero(points[:, 1] == 0.0) + 1, plate)
    first, count = int(plate[0]), len(points)
    corners = count + 1 + np.arange(8)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    box = np.array(list(itertools.product([0, 1], [0, 1], [0, 1])))[[0, 4, 6, 2, 1, 5, 7, 3], :]
    ice = (box - [0.5, 0.5, 1.0]) * [ICE, ICE, 0.5 * height] + middle * [1, 1, 0]
    area = np.ptp(points[:, 0]) * np.ptp(points[:, 1])
    stress, spring = pressure * 1e-6, penalty * 1e-9
    elastic = [material.C10 * 1e-6, material.C01 * 1e-6, material.D1 * 1e6]
    friction = ["*FRICTION", f"{mu},{mu * stress / MOBILISED}"] if mu else []
    lines = [
        "*NODE, NSET=ALL", *rows(np.arange(count) + 1, points), "*NODE, NSET=ICE",
        *rows(corners, ice),
        f"*ELEMENT, TYPE={element}, ELSET=RUBBER", *wrapped(np.arange(len(cells)) + 1, cells + 1),
        "*ELEMENT, TYPE=C3D8, ELSET=SLAB", *wrapped([len(cells) + 1], corners[None]),
        "*NSET, NSET=PLATE", *map(str, plate), "*NSET, NSET=HALF", *map(str, symmetry),
        f"*NSET, NSET=FIRST\n{first}",
        "*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, MOONEY-RIVLIN", listed(elastic),
        "*MATERIAL, NAME=SLAB", "*ELASTIC", "1000.,0.3",
        "*SOLID SECTION, ELSET=RUBBER, MATERIAL=RUBBER",
        "*SOLID SECTION, ELSET=SLAB, MATERIAL=SLAB",
        "*SURFACE, NAME=LOWER, TYPE=ELEMENT", *faces(mesh),
        f"*SURFACE, NAME=UPPER, TYPE=ELEMENT\n{len(cells) + 1},S2",
        "*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{spring}", *friction,
        "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "LOWER,UPPER",
        "*BOUNDARY", "PLATE,1,2", "HALF,2,2", "ICE,2,3", *([] if mu else ["ICE,1,1"]),
        *(f"*EQUATION\n2\n{node},3,1.,{first},3,-1." for node in plate[1:]),
        "*STEP, NLGEOM, INC=200", "*STATIC", f"{FIRST},1.,1e-5,1.",
        *(["*BOUNDARY", f"ICE,1,1,{-WAY}"] if mu else []),
        "*CLOAD", f"{first},3,{-stress * area}",
        "*NODE PRINT, NSET=FIRST, FREQUENCY=1", "U", "*END STEP",
    ]  # fmt: skip
    return "\n".join(lines) + "\n", 3 * count


def solved(program: Sequence[str], folder: Path, cube: Cube) -> Answer:
    """Let CalculiX, the command `program`, solve it in `folder`."""
    text, unknowns = written(cube)
    name = "cube"
    (folder / f"{name}.inp").write_text(text, encoding="utf-8")
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    seconds = processor_seconds([*program, name], cwd=folder, env=environment)
    return Answer(displacement(folder / f"{name}.dat"), unknowns, seconds)


def displacement(results: Path) -> float:
    """How far the plate is down (m) at the end of the step, NaN if it was not reached."""
    last = np.nan
    at_end = False
    for line in results.read_text(encoding="utf-8").splitlines() if results.exists() else []:
        words = line.split()
        if "time" in words:
            at_end = float(words[-1]) == 1.0
        elif len(words) == 4 and at_end:
            last = -1e-3 * float(words[-1])
    return last


def with_middles(points: Array, cells: IntArray, kind: str) -> tuple[Array, IntArray]:
    """Points and cells with nodes in the middle of the edges."""
    edges = cells[:, [[int(one) for one in pair] for pair in EDGES[kind].split()]]
    ends, number = np.unique(np.sort(edges.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    middles = len(points) + number.reshape(len(cells), -1)
    return np.concatenate([points, points[ends].mean(axis=1)]), np.hstack([cells, middles])


def faces(mesh: TaggedMesh) -> list[str]:
    """Element and face of every facet that may touch the ice."""
    contact = {tuple(sorted(facet)) for facet in mesh.facets["contact"].tolist()}
    return [
        f"{cell},S{number}"
        for cell, corners in enumerate(mesh.cells.tolist(), 1)
        for number, face in enumerate(FACES[mesh.cell_type], 1)
        if tuple(sorted(corners[int(one)] for one in face)) in contact
    ]


def listed(values: Iterable[float]) -> str:
    """Numbers with commas between."""
    return ",".join(f"{value:.12g}" for value in values)


def rows(numbers: IntArray, values: Array) -> list[str]:
    """Lines of a number and its values."""
    return [f"{number},{listed(row)}" for number, row in zip(numbers, values, strict=True)]


def wrapped(numbers: Iterable[int], nodes: IntArray) -> list[str]:
    """Lines of elements: at most sixteen entries each."""
    lines = []
    for number, row in zip(numbers, nodes.tolist(), strict=True):
        words = [str(word) for word in (number, *row)]
        parts = [words[i : i + 10] for i in range(0, len(words), 10)]
        lines.append(",\n".join(",".join(part) for part in parts))
    return lines
