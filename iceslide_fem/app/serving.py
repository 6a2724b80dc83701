"""What servers on this machine share: their packages, a socket, the body of a request, the end."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import termination_as_interrupt

if TYPE_CHECKING:  # of the extra `app`
    from starlette.requests import Request

HOME = "127.0.0.1"
EXTRA = (
    "iceslide {} needs starlette and uvicorn, and {} is not installed: "
    "scripts/setup --app, or pip install 'iceslide_fem[app]'"
)


@contextlib.contextmanager
def packages_of(command: str) -> Iterator[None]:
    """Context of imports of a `command`. Raises SceneError if packages of servers are missing."""
    try:
        import uvicorn  # noqa: F401

        yield
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        if name not in ("starlette", "uvicorn"):
            raise
        raise SceneError(EXTRA.format(command, name)) from None


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


@contextlib.contextmanager
def until_interrupted(host: str, port: int) -> Iterator[socket.socket]:
    """A listening socket, closed at the end; an interrupt, or SIGTERM, ends what is in it.

    Raises SceneError.
    """
    with listen(host, port) as listening, termination_as_interrupt():
        with contextlib.suppress(KeyboardInterrupt):
            yield listening


def serve_on(listening: socket.socket, application: Any) -> None:
    """Answer with an ASGI `application` until an interrupt."""
    import uvicorn

    more: Any = {"log_level": "warning", "timeout_graceful_shutdown": 1, "ws": "none"}
    uvicorn.Server(uvicorn.Config(application, **more)).run([listening])


async def body_of(request: Request, largest: int) -> bytes | None:
    """The body of a request, None if it has more than `largest` bytes."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > largest:
            return None
    return body
