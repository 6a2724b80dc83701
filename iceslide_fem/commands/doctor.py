"""`iceslide doctor`: the installed parts, and advice on missing ones."""

from __future__ import annotations

import typer

from iceslide_fem.runtime.errors import SimulationStopped


def doctor() -> None:
    """Say what runs need and whether it is there; exit with 3 if slices and blocks cannot run."""
    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.workflow.installation import can_run, parts

    found = parts()
    table = Table("part", "")
    table.add_column("found", overflow="fold")
    for part in found:
        table.add_row(part.name, "ok" if part.works else "missing", part.found)
    Console().print(table)
    for part in found:
        if not part.works:
            typer.echo(f"{part.name}: {part.cure}.")
    if not can_run(found):
        raise SimulationStopped("slices and blocks cannot run until what they need is there")
    typer.echo("Points, slices and blocks can run.")
