"""`iceslide info`: dimensionless numbers, mesh and cost of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.commands.scene import load, print_notes
from iceslide_fem.runtime.options import CaseName, Overrides, SceneFile


def info(
    scene_file: SceneFile = None,
    case: CaseName = None,
    overrides: Overrides = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png", help="Draw the rubber's mesh into this file.", show_default=False
        ),
    ] = None,
) -> None:
    """Show what a scene means: dimensionless numbers, time scales, mesh and expected cost."""
    scene = load(scene_file, overrides, case)

    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.runtime.terminal import show_notes
    from iceslide_fem.workflow.planning.cost import expected
    from iceslide_fem.workflow.planning.info import describe

    table = Table(title=f"{scene.name} ({scene.model})", title_justify="left")
    for heading in ("", "quantity", "value", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    group = ""
    for row in describe(scene):
        if group and row.group != group:
            table.add_section()
        table.add_row(row.group if row.group != group else "", row.quantity, row.value, row.meaning)
        group = row.group
    Console().print(table)
    print_notes(scene)
    show_notes(expected(scene))
    if picture is not None:
        from iceslide_fem.runtime.files import writing
        from iceslide_fem.workflow.planning.mesh_picture import draw_mesh

        with writing(picture):
            draw_mesh(scene, picture)
        typer.echo(str(picture))
