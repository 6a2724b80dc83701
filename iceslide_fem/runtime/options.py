"""Options shared by several commands; nothing heavy is imported here."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.runtime.errors import SceneError


def _folder(text: str) -> Path:
    """The folder of an option; "" is refused (typer would use the present folder)."""
    if not text.strip():
        raise SceneError('a folder has a name; given: ""')
    return Path(text)


def folder_option(text: str) -> Any:
    """An option that names a folder, with `text` as its help."""
    return typer.Option(metavar="DIR", help=text, show_default=False, parser=_folder)


SceneFile = Annotated[
    Path | None,
    typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False),
]
CaseName = Annotated[
    str | None,
    typer.Option(
        "--case",
        metavar="NAME",
        help="A scene that comes with the program instead; iceslide cases lists them.",
        show_default=False,
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace one value of the scene, e.g. load.pressure=3bar. May be repeated.",
        show_default=False,
    ),
]
Force = Annotated[
    bool, typer.Option("--force", help="Replace other results that the folder holds.")
]
