"""Example scenes of the program: the folder `cases` beside the package, or in it if installed.

The folder `meshes` is beside it, so relative paths between both are valid.
"""

from __future__ import annotations

import re
import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import iceslide_fem
from iceslide_fem.runtime.errors import SceneError

FOLDERS = (".", "laws")  # with scenes; others have tables and surfaces
DATA = ("cases", "meshes")  # data folders in an installed package


class CaseFile(NamedTuple):
    """An example scene: its name, file, model, and a one-line description."""

    name: str
    path: Path
    model: str
    what: str


@cache
def cases_folder() -> Path:
    """The folder of the cases."""
    package = Path(iceslide_fem.__file__).parent
    installed = package / "cases"
    return installed if installed.is_dir() else package.parent / "cases"


def case_files() -> list[CaseFile]:
    """All cases, by their names."""
    return [_case(path) for folder in FOLDERS for path in _scenes(cases_folder() / folder)]


def case_file(name: str) -> Path:
    """The scene file of the case of that name. Raises SceneError with all names."""
    known = {case.name: case.path for case in case_files()}
    if name not in known:
        raise SceneError(f'there is no case "{name}"; allowed: {", ".join(known)}')
    return known[name]


def scene_path(path: Path | str | None, case: str | None) -> Path:
    """The scene file `path`, or that of the `case` of that name. Raises SceneError."""
    if case is None and path is not None:
        return Path(path)
    if case is None or path is not None:
        given = "neither" if path is None else f"{path} and the case {case}"
        raise SceneError(f"give a scene file or the name of a case; given: {given}")
    return case_file(case)


def _scenes(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.toml"))


def _case(path: Path) -> CaseFile:
    text = path.read_text(encoding="utf-8")
    name = path.relative_to(cases_folder()).with_suffix("").as_posix()
    return CaseFile(name, path, tomllib.loads(text)["model"], _first_sentence(text))


def _first_sentence(text: str) -> str:
    """The first sentence of a file's first comment, without text in brackets."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    comment = re.sub(r" \([^)]*\)", "", " ".join(lines))
    return f"{comment.partition('. ')[0].rstrip('.')}."
