"""`iceslide ladder`: a scene on every level."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.commands.report import NoReport, leave_report
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.files import check_writable
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.options import CaseName, Force, Overrides, SceneFile, folder_option
from iceslide_fem.runtime.terminal import say


def ladder(
    scene_file: SceneFile = None,
    case: CaseName = None,
    overrides: Overrides = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name>_ladder.")
    ] = None,
    force: Force = False,
    refine: Annotated[
        list[float] | None,
        typer.Option(
            min=0.1,
            max=4.0,
            metavar="FACTOR",
            help="Mesh refinement relative to the scene's; may be repeated. Else 0.5 and 1.",
            show_default=False,
        ),
    ] = None,
    no_report: NoReport = False,
) -> dict[str, Any]:
    """Run a scene on every level that matters: error, time, memory, and which is enough."""
    from iceslide_fem.scene import load_scene
    from iceslide_fem.scene.cases import scene_path

    scene_file = scene_path(scene_file, case)
    scene = load_scene(scene_file, overrides or [])
    out = out or Path("results") / f"{scene.name}_ladder"
    check_writable(out)
    from iceslide_fem.fenics.start import start_petsc

    start_petsc()
    from rich.console import Console

    from iceslide_fem.workflow.ladder.runs import cheapest_of, climb, finest_of, write_scene
    from iceslide_fem.workflow.ladder.shown import (
        ladder_chart,
        ladder_table,
        not_run,
        simplification_table,
    )

    outcomes, found = climb(scene, out, refine or [0.5, 1.0], say, force)
    console, tolerance = Console(), scene.numerics.tolerance
    console.print(simplification_table(found, tolerance))
    console.print(ladder_table(outcomes))
    for sentence in not_run(outcomes):
        typer.echo(sentence)
    best, finest = cheapest_of(outcomes, tolerance), finest_of(outcomes)
    if best is None or finest is None or finest.run is None:
        raise SimulationStopped("no level of the ladder ran to its end")
    if worth := finest.run.summary.get("verdict"):
        typer.echo(f"{finest.name}: {worth['sentence']}")
    typer.echo(
        f"Within {tolerance:g} of {finest.name} at every time: {best.name} is the cheapest."
        if best is not finest
        else f"No cheaper level is within {tolerance:g} of {finest.name} at every time."
    )
    if rank() == 0:
        title = f"{scene.name}: every level"
        ladder_chart(title, outcomes, finest.run, out / "ladder.png")
        write_scene(scene_file, overrides or [], best.level, out / f"{scene.name}.toml")
    if not no_report:
        leave_report(out)
    for path in (out / "ladder.png", *out.glob("report.html"), out / f"{scene.name}.toml"):
        typer.echo(str(path))
    return {
        "folder": out,
        "tolerance": tolerance,
        "finest": finest.name,
        "cheapest": best.name,
        "levels": [one.as_dict() for one in outcomes],
        "simplifications": [one._asdict() for one in found],
    }
