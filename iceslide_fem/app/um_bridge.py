"""Points as a model of UM-Bridge's protocol, version 1.0, for programs of uncertainty.

L. Seelinger et al., UM-Bridge: Uncertainty quantification and modeling bridge, J. Open Source
Softw. 8 (2023) 4748. A request is JSON; an error is an answer with its type and a sentence.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import Route

from iceslide_fem.app.serving import body_of
from iceslide_fem.inference.parameters import checked
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.scene import Scene

NAME, VERSION = "point", 1.0
LARGEST_REQUEST = 20_000_000  # bytes
MOST = 100_000  # points of a call
SUPPORT = {"Evaluate": True, "Gradient": False, "ApplyJacobian": False, "ApplyHessian": False}


class Refused(Exception):
    """A request that is answered with an error of a `kind`."""

    def __init__(self, kind: str, sentence: str) -> None:
        super().__init__(sentence)
        self.kind = kind


class PointModel(NamedTuple):
    """Outputs of a point `scene` over numbers of it: `inputs` are keys, with values in SI.

    A call has one vector for each input, and one for each output. They have one value, or as many
    as the request's `config` says by "points".
    """

    scene: Scene
    inputs: Sequence[str]
    outputs: Sequence[str]

    def points(self, config: Mapping[str, Any]) -> int:
        """Number of points of a call. Raises Refused."""
        number = config.get("points", 1)
        if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= MOST:
            raise Refused("InvalidInput", f"points is {number}; allowed: 1 to {MOST}")
        return number

    def __call__(self, vectors: Any, config: Mapping[str, Any]) -> list[list[float]]:
        """The outputs at vectors of the inputs. Raises Refused."""
        number = self.points(config)
        try:
            values = np.array(vectors, dtype=float)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if values.shape != (len(self.inputs), number) or not np.isfinite(values).all():
            raise Refused(
                "InvalidInput",
                f"the input is not {len(self.inputs)} vectors ({', '.join(self.inputs)}) of "
                f"{number} finite numbers each",
            )
        try:
            scenes = [
                checked(self.scene, dict(zip(self.inputs, map(float, column), strict=True)))
                for column in values.T
            ]
            found = friction(scenes)
        except IceslideError as error:
            raise Refused("InvalidInput", str(error)) from None
        if found.failures:
            (at, _), why = next(iter(found.failures.items()))
            raise Refused("InvalidOutput", f"point {at + 1} of {number}: {why}")
        return [getattr(found, name)[:, 0].tolist() for name in self.outputs]


def application(model: PointModel, hosts: Sequence[str]) -> Starlette:
    """The server of a model; hosts: allowed host names in requests."""

    async def info(_: Request) -> JSONResponse:
        return JSONResponse({"protocolVersion": VERSION, "models": [NAME]})

    def answering(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> Callable[[Request], Any]:
        async def endpoint(request: Request) -> JSONResponse:
            try:
                asked = await _asked(request)
                return JSONResponse(await run_in_threadpool(answer, asked))
            except Refused as error:
                fault = {"type": error.kind, "message": str(error)}
                return JSONResponse({"error": fault}, 400)

        return endpoint

    def config(asked: Mapping[str, Any]) -> dict[str, Any]:
        return asked.get("config") or {}

    def sizes(count: int) -> Callable[[dict[str, Any]], list[int]]:
        return lambda asked: [model.points(config(asked))] * count

    answers: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
        "ModelInfo": lambda asked: {"support": SUPPORT},
        "InputSizes": lambda asked: {"inputSizes": sizes(len(model.inputs))(asked)},
        "OutputSizes": lambda asked: {"outputSizes": sizes(len(model.outputs))(asked)},
        "Evaluate": lambda asked: {"output": model(asked.get("input"), config(asked))},
    }
    routes = [Route(f"/{name}", answering(one), methods=["POST"]) for name, one in answers.items()]
    allowed = Middleware(TrustedHostMiddleware, allowed_hosts=list(hosts), www_redirect=False)
    return Starlette(routes=[Route("/Info", info), *routes], middleware=[allowed])


async def _asked(request: Request) -> dict[str, Any]:
    """What a request asks of the model. Raises Refused."""
    body = await body_of(request, LARGEST_REQUEST)
    if body is None:
        raise Refused("InvalidInput", "the request is too large")
    try:
        asked = json.loads(body)
        name = asked["name"]
    except (ValueError, TypeError, KeyError, RecursionError):
        raise Refused("InvalidInput", "the request is no JSON with the name of a model") from None
    if name != NAME:
        raise Refused("ModelNotFound", f"there is no model {name}; this one is {NAME}")
    if not isinstance(asked.get("config") or {}, dict):
        raise Refused("InvalidInput", "config is no table")
    return asked
