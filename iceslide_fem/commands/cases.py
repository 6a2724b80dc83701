"""`iceslide cases`: the scenes that come with the program."""

from __future__ import annotations

import typer

COST = {"point": "seconds", "slice": "seconds", "block": "a minute"}  # time of a run on one core


def cases() -> None:
    """List the scenes that come with the program: iceslide run --case NAME."""
    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.scene.cases import case_files, cases_folder

    table = Table()
    for heading in ("case", "what it is", "model", "takes"):
        table.add_column(heading, no_wrap=heading != "what it is")
    for case in case_files():
        table.add_row(case.name, case.what, case.model, COST[case.model])
    Console().print(table)
    typer.echo(f"Files: {cases_folder()}")
