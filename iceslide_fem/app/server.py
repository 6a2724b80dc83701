"""The page's server: access and routing, without computation.

Every valid address begins with a random token; other addresses are refused. A request with another
host name is also refused (protection against DNS rebinding). Requests of the page are POSTs of JSON
to `api/NAME`. Invalid input is answered with 422, the command line's message, and the keys that it
names.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import signal
import sys
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import (
    FileResponse,
    JSONResponse,
    PlainTextResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iceslide_fem.app.answers import Answers
from iceslide_fem.app.runs import Runs
from iceslide_fem.app.serving import body_of
from iceslide_fem.runtime.errors import IceslideError

Answer = Callable[[Mapping[str, Any]], Any]
PAGE = Path(__file__).parent / "page"
LARGEST_REQUEST = 100_000  # bytes
SECONDS_BETWEEN_NEWS = 0.25
REFUSED = (
    "This is not the address of a running page: open the one that `iceslide app` has printed.\n"
)
# Nothing is fetched from elsewhere, and the address is not sent anywhere. Charts set inline styles.
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; frame-ancestors 'self'; form-action 'none'; base-uri 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
}
# A report is self-contained, with scripts; it fetches and sends nothing.
REPORT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; img-src data: blob:; "
    "style-src 'unsafe-inline'; font-src data:; worker-src blob:; frame-ancestors 'self'; "
    "sandbox allow-scripts allow-downloads allow-popups"
)


class Guard:
    """Middleware: the first part of the path is the token, or the request is refused (403)."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] == "http":
            first = scope["path"].lstrip("/").partition("/")[0]
            if not secrets.compare_digest(first.encode(errors="replace"), self._token):
                response = PlainTextResponse(REFUSED, 403, HEADERS)
                await response(scope, receive, send)
                return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                there = {name for name, _ in message["headers"]}
                more = ((k.lower().encode(), v.encode()) for k, v in HEADERS.items())
                message["headers"] += [pair for pair in more if pair[0] not in there]
            await send(message)

        await self._app(scope, receive, send_with_headers)


def application(token: str, answers: Answers, runs: Runs, hosts: Sequence[str]) -> Starlette:
    """The ASGI application of one page. `hosts`: allowed host names in requests."""

    def asked(name: str, answer: Answer) -> Callable[[Request], Any]:
        async def endpoint(request: Request) -> Response:
            return await _answered(request, name, answer)

        return endpoint

    def news(request: Request) -> Response:
        return StreamingResponse(_news(request, runs), media_type="text/event-stream")

    def report(request: Request) -> Response:
        return _report(runs, request.path_params["number"])

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        watching = asyncio.create_task(_stop_unwatched(runs))
        try:
            yield
        finally:
            watching.cancel()
            await run_in_threadpool(runs.close)

    named = answers.by_name().items()
    inner = [
        *(Route(f"/api/{name}", asked(name, each), methods=["POST"]) for name, each in named),
        Route("/api/runs/{number:int}/news", news),
        Route("/runs/{number:int}/report", report),
        Mount("/", StaticFiles(directory=PAGE, html=True)),
    ]
    return Starlette(
        routes=[Mount(f"/{token}", routes=inner)],
        middleware=[
            Middleware(TrustedHostMiddleware, allowed_hosts=list(hosts), www_redirect=False),
            Middleware(Guard, token=token),
        ],
        lifespan=lifespan,
    )


async def _answered(request: Request, name: str, answer: Answer) -> Response:
    """The answer as JSON, or 422 with a message and the keys that it names."""
    if request.headers.get("content-type", "").partition(";")[0] != "application/json":
        return JSONResponse({"sentence": "only JSON is answered", "keys": []}, 415)
    body = await body_of(request, LARGEST_REQUEST)
    if body is None:
        return JSONResponse({"sentence": "the request is too large", "keys": []}, 413)
    try:
        asked = json.loads(body)
        if not isinstance(asked, dict):
            raise ValueError
    except (ValueError, RecursionError):
        return JSONResponse({"sentence": "the request is no table in JSON", "keys": []}, 400)
    try:
        return JSONResponse(await run_in_threadpool(answer, asked))
    except IceslideError as error:
        sentence = str(error)
    finally:
        _hear_signals()
    return JSONResponse(Answers.refused(name, sentence), 422)


def _hear_signals() -> None:
    """Restore signal handlers: gmsh in another thread resets them."""
    if "gmsh" in sys.modules:
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGPIPE):
            signal.signal(number, signal.getsignal(number))


async def _news(request: Request, runs: Runs) -> AsyncIterator[str]:
    """Progress of a run as server-sent events until it ends; a reader counts as a watcher."""
    try:
        run = runs.get(request.path_params["number"])
    except IceslideError as error:
        yield _event({"state": "unknown", "sentence": str(error)})
        return
    run.watchers += 1
    known = 0
    try:
        while not await request.is_disconnected():
            found = await run_in_threadpool(run.progress, known)
            known = found["count"]
            yield _event(found)
            if found["state"] not in ("running", "stopping"):
                return
            await asyncio.sleep(SECONDS_BETWEEN_NEWS)
    finally:
        run.watchers -= 1
        run.unwatched_since = time.monotonic()


def _event(data: Mapping[str, Any]) -> str:
    return f"data: {json.dumps(data)}\n\n"


async def _stop_unwatched(runs: Runs) -> None:
    while True:
        await asyncio.sleep(1.0)
        runs.stop_unwatched()


def _report(runs: Runs, number: int) -> Response:
    """The report of a run; no other file of its folder is served."""
    try:
        path = runs.get(number).report()
    except IceslideError as error:
        return PlainTextResponse(f"{error}\n", 404)
    if path is None:
        return PlainTextResponse("This run has left no report.\n", 404)
    kind = "text/html; charset=utf-8" if path.suffix == ".html" else "image/png"
    headers = {"Content-Security-Policy": REPORT_POLICY} if path.suffix == ".html" else None
    return FileResponse(path, media_type=kind, headers=headers)
