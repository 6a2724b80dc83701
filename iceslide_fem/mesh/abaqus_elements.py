"""Elements of Abaqus and CalculiX: their shape by their type's name, and their sides.

An element is read as the shape that it is: C3D8, C3D8R, C3D8H and C3D8RH are hexahedra, CPE4 and
S4R quadrilaterals. Sides are numbered as in the guide of Abaqus for solid elements.
"""

from __future__ import annotations

import re

_SOLID = {
    4: "tetrahedron",
    5: "pyramid",
    6: "wedge",
    8: "hexahedron",
    10: "tetrahedron10",
    15: "wedge15",
    20: "hexahedron20",
    27: "hexahedron27",
}
_PLANE = {
    3: "triangle",
    4: "quadrilateral",
    6: "triangle6",
    65: "triangle6",  # STRI65
    7: "triangle7",
    8: "quadrilateral8",
    9: "quadrilateral9",
}
_FAMILIES = [  # what a type's name begins with, dimension, kind by the number that follows
    (r"(?:C|DC|AC|COH|GK|Q|EMC)3D|CSS|SC", 3, _SOLID),
    (r"CPEG?|CPS|CG?AX|DC2D|DCAX|AC2D|ACAX|COH2D|EMC2D|WARP2D", 2, _PLANE),
    (r"M3D|SFM3D|R3D|F3D|DS|STRI|S", 2, _PLANE),
    (r"[TR][23]D|RB[23]D|RAX|F2D|FAX|DC1D|AC1D", 1, {2: "line", 3: "line3"}),
    (r"B[23]|PIPE[23]|D?SAX|MG?AX|SFMG?AX", 1, {1: "line", 2: "line3", 3: "line"}),
]
_TYPES = [
    (re.compile(rf"(?:{names})(\d+)(?:[A-Z].*)?"), dim, kinds) for names, dim, kinds in _FAMILIES
]
_SHELL = re.compile(r"(?:M3D|SFM3D|R3D|F3D|DS|STRI|S)\d")

NODES = {
    "line": 2,
    "line3": 3,
    "triangle": 3,
    "quadrilateral": 4,
    "triangle6": 6,
    "triangle7": 7,
    "quadrilateral8": 8,
    "quadrilateral9": 9,
    "tetrahedron": 4,
    "pyramid": 5,
    "wedge": 6,
    "hexahedron": 8,
    "tetrahedron10": 10,
    "wedge15": 15,
    "hexahedron20": 20,
    "hexahedron27": 27,
}
SIDES: dict[str, list[tuple[int, ...]]] = {  # S1, S2, ... by corners
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quadrilateral": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetrahedron": [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    "hexahedron": [
        (0, 1, 2, 3),
        (4, 7, 6, 5),
        (0, 4, 5, 1),
        (1, 5, 6, 2),
        (2, 6, 7, 3),
        (3, 7, 4, 0),
    ],
}


def shape(kind: str) -> tuple[int, str]:
    """Dimension and kind (of `named_cells`) of an element type; 0 and its name where unknown."""
    for pattern, dim, kinds in _TYPES:
        if (match := pattern.fullmatch(kind)) and int(match[1]) in kinds:
            return dim, kinds[int(match[1])]
    return 0, kind


def is_shell(kind: str) -> bool:
    """Whether an element type is a surface in space, whose S1 and S2 are its two faces."""
    return _SHELL.match(kind) is not None
