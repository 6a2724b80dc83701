"""Options that several commands have, each written once; nothing heavy is imported here."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.runtime.errors import SceneError


def _folder(text: str) -> Path:
    """The folder that an option names; typer would take "" for the present one."""
    if not text.strip():
        raise SceneError('a folder has a name; given: ""')
    return Path(text)


def folder_option(text: str) -> Any:
    """An option that names a folder, with `text` as its help."""
    return typer.Option(metavar="DIR", help=text, show_default=False, parser=_folder)


def option(metavar: str, text: str, default: str = "") -> Any:
    """An option whose `Text` is checked later, with all others of its command."""
    shown = f" [dim]\\[default: {default}][/dim]" if default else ""
    return typer.Option(metavar=metavar, help=text + shown, show_default=False)


Text = str | None
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
