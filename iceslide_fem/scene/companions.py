"""Files that a mesh file needs: data files of XDMF, includes of an Abaqus file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

_DATA = re.compile(r">\s*([^<>:]+):/")  # of XDMF: name.h5:/where
_INPUT = re.compile(r'^\s*\*[^*].*\bINPUT\s*=\s*"?([^,"\n]+)', re.IGNORECASE)
DEEPEST = 10  # files in files


def companions(path: Path) -> list[Path]:
    """Existing files that `path` refers to, directly or through other files, without duplicates."""
    return [*dict.fromkeys(_named(path, 0))]


def _named(path: Path, depth: int) -> Iterator[Path]:
    suffix = path.suffix.lower()
    pattern = _DATA if suffix == ".xdmf" else _INPUT
    if depth == DEEPEST or (depth == 0 and suffix not in (".xdmf", ".inp")):
        return
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            names = [name for line in file for name in pattern.findall(line)]
    except OSError:  # the mesh reader reports it
        return
    for name in names:
        other = path.parent / name.strip().replace("\\", "/")
        if other.is_file():
            yield other
            if pattern is _INPUT:
                yield from _named(other, depth + 1)
