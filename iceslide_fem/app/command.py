"""`iceslide app`: a private address, the server, the browser.

Nothing heavy is imported before the options are read.
"""

from __future__ import annotations

import os
import secrets
import socket
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import psutil
import typer

from iceslide_fem.app.serving import HOME, packages_of, serve_on, until_interrupted
from iceslide_fem.runtime.files import check_writable
from iceslide_fem.runtime.options import folder_option

WARNING = (
    "Warning: with --host {} everyone who reaches this machine and has the address can run scenes "
    "on it as you, and what is sent is not encrypted."
)


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
    ] = HOME,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address and open no browser.")
    ] = False,
) -> None:
    """A page in the browser: sliders for friction of a point, a line, a wheel; scenes to run."""
    folder = out or Path("results")
    with packages_of("app"):
        from iceslide_fem.app.answers import Answers
        from iceslide_fem.app.form import texts_of
        from iceslide_fem.app.runs import Runs
        from iceslide_fem.app.server import application
        from iceslide_fem.scene import read_scene, scene_from_dict
    check_writable(folder)
    link = scene.partition("#")[2] if scene and "://" in scene else ""
    data = read_scene(scene) if scene and "://" not in scene else {}
    if data:
        scene_from_dict(data)
    token = secrets.token_urlsafe(24)
    runs = Runs(folder)
    served = application(token, Answers(runs, texts_of(data), link), runs, _names(host))
    with until_interrupted(host, port) as listening:
        if host != HOME:
            print(WARNING.format(host), file=sys.stderr)
        address = f"http://{_shown(host)}:{listening.getsockname()[1]}/{token}/"
        print(f"{address}\nCtrl-C ends the page and the runs that it has started.", flush=True)
        if not no_browser and _has_screen():
            webbrowser.open(address)
        serve_on(listening, served)


def _names(host: str) -> list[str]:
    """Allowed host names in requests: local ones, and with another `host` its addresses."""
    names = ["localhost", HOME]
    if host != HOME:
        addresses = [each.address for all in psutil.net_if_addrs().values() for each in all]
        names += [host, socket.gethostname(), socket.getfqdn(), *addresses]
    return names


def _shown(host: str) -> str:
    """The host for this machine's browser."""
    if host in ("0.0.0.0", "::", ""):
        return HOME
    return f"[{host}]" if ":" in host else host


def _has_screen() -> bool:
    """Whether a graphical browser can open."""
    return sys.platform != "linux" or any(os.environ.get(n) for n in ("DISPLAY", "WAYLAND_DISPLAY"))
