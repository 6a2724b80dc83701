"""Input files named by a user: only regular files of limited size are opened."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular, is_regular

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


LARGEST_TEXT = 10_000_000  # bytes


def _regular(path: Path) -> Path:
    if not is_regular(path):
        raise PydanticCustomError("path_not_file", "is not a file")
    return path.absolute()  # valid in another working directory, where a run is continued


InputFile = Annotated[Path, AfterValidator(_regular)]  # like pydantic's FilePath, without OSError


def read_text(path: Path, what: str) -> str:
    """Text of the file at `path`, without a byte order mark; what: its name in messages.

    Raises SceneError if it is not a regular file, is larger than 10 MB or is not UTF-8.
    """
    check_regular(path, what)
    try:
        if (size := path.stat().st_size) > LARGEST_TEXT:
            reason = f"it has {size / 1e6:.0f} MB; allowed: up to {LARGEST_TEXT / 1e6:.0f} MB"
        else:
            return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError:  # not UTF-8, or an invalid file name
        reason = "it is not UTF-8 text"
    raise SceneError(f"cannot read {what} {path}: {reason}")
