"""The options of `iceslide app`; nothing heavy is imported before they are read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.runtime.options import folder_option


def app(
    scene: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENE.toml|LINK",
            help="A scene file to begin with, or a link that was copied from the page.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None, folder_option("Where runs get their folders; else results.")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")
    ] = 0,
    host: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="Address to listen on. Every other one than the default opens the page to the "
            "network.",
        ),
    ] = "127.0.0.1",
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address and open no browser.")
    ] = False,
) -> None:
    """A page in the browser: sliders for friction of a point, a line, a wheel; scenes to run."""
    from iceslide_fem.app.command import serve

    serve(scene, out or Path("results"), host, port, not no_browser)
