"""`iceslide cases`: the scenes that come with the program."""

from __future__ import annotations

from typing import Any

import typer

COST = {"point": "seconds", "slice": "seconds", "block": "a minute"}  # time of a run on one core


def cases() -> dict[str, Any]:
    """List the scenes that come with the program: iceslide run --case NAME."""
    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.scene.cases import case_files, cases_folder

    found, table = case_files(), Table()
    for heading in ("case", "what it is", "model", "takes"):
        table.add_column(heading, no_wrap=heading != "what it is")
    for case in found:
        table.add_row(case.name, case.what, case.model, COST[case.model])
    Console().print(table)
    typer.echo(f"Files: {cases_folder()}")
    return {"folder": cases_folder(), "cases": [case._asdict() for case in found]}
