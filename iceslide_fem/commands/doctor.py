"""`iceslide doctor`: the installed parts, and advice on missing ones."""

from __future__ import annotations

from typing import Any

import typer

from iceslide_fem.runtime.errors import SimulationStopped


def doctor() -> dict[str, Any]:
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
    answer = {"can_run": can_run(found), "parts": [part._asdict() for part in found]}
    if not answer["can_run"]:
        raise SimulationStopped(
            "slices and blocks cannot run until what they need is there", answer
        )
    typer.echo("Points, slices and blocks can run.")
    return answer
