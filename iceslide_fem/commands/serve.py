"""`iceslide serve`: points for programs of uncertainty, by UM-Bridge's protocol."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.app.serving import HOME, packages_of, serve_on, until_interrupted
from iceslide_fem.runtime.errors import SceneError

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
    with packages_of("serve"):
        from iceslide_fem.app.um_bridge import PointModel, application
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
    with until_interrupted(HOME, port) as listening:
        print(f"http://{HOME}:{listening.getsockname()[1]}\nCtrl-C ends it.", flush=True)
        serve_on(listening, served)
