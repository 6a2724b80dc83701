"""Element types of Abaqus and CalculiX, and their sides."""

from __future__ import annotations

import re
from typing import NamedTuple

from iceslide_fem.mesh.named_cells import KINDS
from iceslide_fem.mesh.tagged import FACETS

SHELLS = "M3D|SFM3D|R3D|F3D|DS|STRI|S"  # surfaces in space, whose S1 and S2 are their two faces
_FAMILIES = [  # what a type's name begins with, dimension, number of nodes by the one that follows
    ("(?:C|DC|AC|COH|GK|Q|EMC)3D|CSS|SC", 3, {}),
    ("CPEG?|CPS|CG?AX|DC2D|DCAX|AC2D|ACAX|COH2D|EMC2D|WARP2D", 2, {}),
    (SHELLS, 2, {}),
    ("[TR][23]D|RB[23]D|RAX|F2D|FAX|DC1D|AC1D", 1, {}),
    ("B[23]|PIPE[23]|D?SAX|MG?AX|SFMG?AX", 1, {1: 2, 2: 3, 3: 2}),
]


class Element(NamedTuple):
    """nodes: indices in the model, -1 for a node missing in the file."""

    type: str
    kind: str
    nodes: tuple[int, ...]

    @property
    def dim(self) -> int:
        """Dimension; 0 for an unknown type."""
        return KINDS[self.kind].dim if self.kind in KINDS else 0

    @property
    def sides(self) -> list[tuple[int, ...]]:
        """Nodes of S1, S2, ..."""
        facets = FACETS.get(self.kind, [])
        return [tuple(self.nodes[corner] for corner in facet) for facet in facets]


def kind_of(type_: str) -> str:
    """The kind (of `KINDS`) of an element type, from its name; the type itself if unknown.

    C3D8, C3D8R, C3D8H and C3D8RH are hexahedra, CPE4 and S4R quadrilaterals.
    """
    for names, dim, counts in _FAMILIES:
        if match := re.fullmatch(rf"(?:{names})(\d+)(?:[A-Z].*)?", type_):
            count = counts.get(int(match[1]), int(match[1]))
            for kind, form in KINDS.items():
                if (form.dim, form.nodes) == (dim, count):
                    return kind
    return type_
