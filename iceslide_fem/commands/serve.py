"""`iceslide serve`: points for programs of uncertainty, by UM-Bridge's protocol."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.app.command import EXTRA, HOME, listen
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import termination_as_interrupt

PORT = 4242  # of UM-Bridge's examples


def serve(
    scene: Annotated[
        Path, typer.Argument(metavar="SCENE.toml", help="A scene of a point.", show_default=False)
    ],
    input: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY", help="A number of the scene that a request gives, in SI: "
                     "load.speed. May be repeated.", show_default=False),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(metavar="mu_mean|mu_peak|mu_end", help="What is answered. May be repeated.",
                     show_default="mu_mean"),
    ] = None,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Another value of the scene.",
                     show_default=False),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")
    ] = PORT,
) -> None:  # fmt: skip
    """Answer programs on this machine with friction of points, by UM-Bridge's protocol."""
    try:
        import uvicorn

        from iceslide_fem.exchange.um_bridge import PointModel, application
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        if name not in ("starlette", "uvicorn"):
            raise
        raise SceneError(EXTRA.format("serve", name)) from None
    from iceslide_fem.runs.many_points import OUTPUTS
    from iceslide_fem.scene import load_scene
    from iceslide_fem.scene.variation import number_at, parameter

    found = load_scene(scene, change or [])
    if found.model != "point":
        raise SceneError(
            f'model = "{found.model}" is not served; allowed: "point", as by --set model=point'
        )
    inputs, outputs = input or [], output or [OUTPUTS[0]]
    if not inputs:
        raise SceneError("there is nothing that a request gives; give --input, as in load.speed")
    for key in inputs:
        parameter(key)
        if number_at(found, key) is None:
            raise SceneError(f"--input {key} is no number in this scene")
        if inputs.count(key) > 1:
            raise SceneError(f"--input {key} is given twice")
    for name in outputs:
        if name not in OUTPUTS:
            raise SceneError(f"--output {name} is none; allowed: {', '.join(OUTPUTS)}")
    served = application(PointModel(found, inputs, outputs), ["localhost", HOME])
    config = uvicorn.Config(served, log_level="warning", timeout_graceful_shutdown=1, ws="none")
    with listen(HOME, port) as listening, termination_as_interrupt():
        try:
            print(f"http://{HOME}:{listening.getsockname()[1]}\nCtrl-C ends it.", flush=True)
            uvicorn.Server(config).run([listening])
        except KeyboardInterrupt:
            pass
