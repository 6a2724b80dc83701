"""The lines of an input file of Abaqus or CalculiX as cards: a keyword, its options, its data.

Keywords and options are case-insensitive, and blanks around them are ignored. A line that begins
with `**` is a comment. A keyword line that ends with a comma continues on the next line (Abaqus,
input syntax rules).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from iceslide_fem.mesh.named_cells import KINDS
from iceslide_fem.mesh.tagged import FACETS
from iceslide_fem.runtime.errors import SceneError

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


DEEPEST = 10  # *INCLUDE in included files
# These keywords generate or move nodes and elements, so the mesh would be wrong without them.
_GENERATORS = {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM"}
_GENERATORS |= {"SYMMETRIC MODEL GENERATION"}


class Card(NamedTuple):
    """keyword: in capitals, without `*`; options: by names in capitals; data: its lines."""

    keyword: str
    options: dict[str, str]
    data: list[str]

    def label(self, option: str) -> str:
        """Normalised name given by the option; "" without it."""
        return key(self.options.get(option, ""))


def key(name: str) -> str:
    """Normalised name for comparison."""
    return name.strip().strip('"').strip().casefold()


def items(line: str) -> list[str]:
    """Non-empty items of a line, separated by commas."""
    return [item for part in line.split(",") if (item := part.strip())]


def read_cards(path: Path) -> Iterator[Card]:
    """All cards of a file, with those of the files that it includes.

    Raises SceneError where a file can't be read.
    """
    card, begun = Card("", {}, []), ""
    for line in _lines(path, path, 0):
        if not begun and not line.startswith("*"):
            card.data.append(line)
            continue
        if not begun:
            yield card
        begun += line
        if not begun.endswith(","):
            card, begun = _card(begun), ""
            if "INPUT" in card.options:  # data in another file
                card.data.extend(_lines(path, _beside(path, card), 1))
    yield card


def scopes_of(path: Path) -> dict[str, list[Card]]:
    """Cards by scope of numbers and names: an instance, a part (without instances), or "".

    "" holds all cards outside of instances and parts. An instance has its own card, then those of
    its part. Raises SceneError if a file can't be read, ValueError if it is invalid.
    """
    outside: list[Card] = []
    parts: dict[str, list[Card]] = {}
    instances: dict[str, list[Card]] = {}
    here = outside
    for card in read_cards(path):
        if card.keyword in _GENERATORS:
            raise ValueError(
                f"it makes or moves nodes or elements by *{card.keyword}; allowed are those that "
                "are written out (*NODE, *ELEMENT)"
            )
        if card.keyword in ("END PART", "END INSTANCE"):
            here = outside
        elif card.keyword == "PART":
            here = parts.setdefault(card.label("NAME"), [])
        elif card.keyword == "INSTANCE":
            if card.label("PART") not in parts:
                raise ValueError(
                    f"*INSTANCE {card.options.get('NAME', '')} is of the part "
                    f'"{card.options.get("PART", "")}", which is not in the file before it'
                )
            here = instances[card.label("NAME")] = [card, *parts[card.label("PART")]]
        else:
            here.append(card)
    return {"": outside, **(instances or parts)}


def _card(line: str) -> Card:
    keyword, *options = items(line[1:]) or [""]
    pairs = (option.partition("=")[::2] for option in options)
    named = {name.strip().upper(): value.strip().strip('"') for name, value in pairs}
    return Card(" ".join(keyword.upper().split()), named, [])


def _lines(main: Path, path: Path, depth: int) -> Iterator[str]:
    """Stripped lines without comments, with included files inserted."""
    if depth > DEEPEST:
        raise SceneError(f"rubber.mesh {main}: *INCLUDE goes round in a circle, at {path}")
    try:
        with open(path, encoding="utf-8-sig", errors="replace") as file:
            for line in map(str.strip, file):
                if line[:8].upper() == "*INCLUDE":
                    yield from _lines(main, _beside(path, _card(line)), depth + 1)
                elif line and not line.startswith("**"):
                    yield line
    except OSError as error:
        what = "can't be read" if path == main else f"includes {path}, which can't be read"
        raise SceneError(f"rubber.mesh {main} {what}: {error.strerror or error}") from None


def _beside(path: Path, card: Card) -> Path:
    """The file that a card names as its INPUT."""
    return path.parent / card.options.get("INPUT", "").replace("\\", "/")


def real(text: str) -> float:
    """A real number, also in Fortran notation (1.5D-3); an empty field is 0."""
    try:
        return float(text.upper().replace("D", "E") if text.strip() else 0.0)
    except ValueError:
        raise ValueError(f'"{text.strip()}" is no number') from None


def whole(text: str) -> int:
    """A number of a node or element."""
    try:
        return int(text)
    except ValueError:
        raise ValueError(f'"{text.strip()}" is no number of a node or element') from None


def span(line: str) -> range:
    """The numbers of a line of GENERATE: first, last and increment (default 1)."""
    try:
        first, last, step = [*map(int, items(line)), 1][:3]
        return range(first, last + (1 if step > 0 else -1), step)
    except ValueError:
        raise ValueError(f'GENERATE takes first, last and increment, not "{line}"') from None
