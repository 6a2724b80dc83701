"""`iceslide info`: dimensionless numbers, mesh and cost of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.commands.scene import load
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
) -> dict[str, Any]:
    """Show what a scene means: dimensionless numbers, time scales, mesh and expected cost."""
    scene = load(scene_file, overrides, case)

    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.runtime.terminal import show_notes
    from iceslide_fem.workflow.planning.about import about

    known = about(scene)
    table = Table(title=f"{known.name} ({known.model})", title_justify="left")
    for heading in ("", "quantity", "value", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    group = ""
    for row in known.rows:
        if group and row.group != group:
            table.add_section()
        table.add_row(row.group if row.group != group else "", row.quantity, row.value, row.meaning)
        group = row.group
    Console().print(table)
    show_notes(known.notes)
    if picture is not None:
        from iceslide_fem.runtime.files import writing
        from iceslide_fem.workflow.planning.mesh_picture import draw_mesh

        with writing(picture):
            draw_mesh(scene, picture)
        typer.echo(str(picture))
    return known.as_dict()
