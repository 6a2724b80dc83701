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

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_writable
from iceslide_fem.runtime.launch import termination_as_interrupt
from iceslide_fem.runtime.options import folder_option

HOME = "127.0.0.1"
EXTRA = (
    "iceslide {} needs starlette and uvicorn, and {} is not installed: "
    "scripts/setup --app, or pip install 'iceslide_fem[app]'"
)
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
    try:
        import uvicorn

        from iceslide_fem.app.answers import Answers
        from iceslide_fem.app.form import texts_of
        from iceslide_fem.app.runs import Runs
        from iceslide_fem.app.server import application
        from iceslide_fem.scene import read_scene, scene_from_dict
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        if name not in ("starlette", "uvicorn"):
            raise
        raise SceneError(EXTRA.format("app", name)) from None
    check_writable(folder)
    link = scene.partition("#")[2] if scene and "://" in scene else ""
    data = read_scene(scene) if scene and "://" not in scene else {}
    if data:
        scene_from_dict(data)
    token = secrets.token_urlsafe(24)
    runs = Runs(folder)
    served = application(token, Answers(runs, texts_of(data), link), runs, _names(host))
    config = uvicorn.Config(served, log_level="warning", timeout_graceful_shutdown=1, ws="none")
    with listen(host, port) as listening, termination_as_interrupt():
        try:
            if host != HOME:
                print(WARNING.format(host), file=sys.stderr)
            address = f"http://{_shown(host)}:{listening.getsockname()[1]}/{token}/"
            print(f"{address}\nCtrl-C ends the page and the runs that it has started.", flush=True)
            if not no_browser and _has_screen():
                webbrowser.open(address)
            uvicorn.Server(config).run([listening])
        except KeyboardInterrupt:
            pass


def listen(host: str, port: int) -> socket.socket:
    """A listening socket. Raises SceneError."""
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listening = socket.socket(family, kind, protocol)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(where)
        listening.listen(128)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"cannot listen on --host {host} --port {port}: {reason}") from None
    return listening


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
