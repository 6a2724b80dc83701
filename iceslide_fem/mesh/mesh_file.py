"""A mesh file that a scene names, and what the scene wants of it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

RUBBER_PARTS = ("contact", "plate", "symmetry", "walls")  # facets of rubber that have a meaning


class MeshFile(NamedTuple):
    """The file `path` that the scene's `key` names: its cells of dimension `dim` with the names
    `bodies`, and facets, of which the names `parts` have a meaning.

    Cells of other names may be in the file (they are left out), or only those of the names in
    `beside`, where that is given. As text it is what messages begin with.
    """

    key: str
    path: Path
    dim: int
    bodies: tuple[str, ...]
    parts: tuple[str, ...]
    beside: tuple[str, ...] | None = None

    def __str__(self) -> str:
        return f"{self.key} {self.path}"

    @property
    def body(self) -> str:
        """The names of the cells, for a message."""
        first, *others = (f'"{name}"' for name in self.bodies)
        return f"{first} with {' and '.join(others)}" if others else first


def rubber_file(path: Path, dim: int, body: str = "rubber") -> MeshFile:
    """A file with the mesh of a tread block."""
    return MeshFile("rubber.mesh", path, dim, (body,), RUBBER_PARTS)
