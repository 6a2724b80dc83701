"""`iceslide view`: pictures of a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_writable
from iceslide_fem.runtime.launch import rank


def view(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="What `iceslide run` wrote.", show_default=False)
    ],
    animate: Annotated[bool, typer.Option("--animate", help="Make a film, too.")] = False,
) -> dict[str, Any]:
    """Make pictures of a finished run and print their paths."""
    if not (directory / "summary.json").is_file():
        stopped = (directory / "checkpoint").is_file()
        hint = f"iceslide run --restart {directory} goes on" if stopped else "no summary.json in it"
        raise SceneError(f"{directory} holds no finished run ({hint})")
    if rank() > 0:  # one process makes the pictures
        return {}

    check_writable(directory)
    from iceslide_fem.postprocess.results.view import view as make_pictures

    pictures = make_pictures(directory, animate)
    for picture in pictures:
        typer.echo(str(picture))
    return {"folder": directory, "pictures": pictures}
