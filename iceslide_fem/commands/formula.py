"""`iceslide formula`: the formulas of chapter 2 of the thesis at given values."""

from __future__ import annotations

from typing import Annotated

import typer


def formula(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", help="Which; without it all are listed.", show_default=False
        ),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="KEY=VALUE...",
            help="temperature=-4degC aggregate=0,200,500: of several values every combination.",
            show_default=False,
        ),
    ] = None,
    csv: Annotated[
        bool, typer.Option("--csv", help="Print rows with commas, in SI units.")
    ] = False,
) -> None:
    """Friction on ice by an empirical formula: aggregate, film, ellipse of the patch."""
    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.preprocess.footprint.formulas import FORMULAS, evaluate

    if name is None:
        table = Table("formula", "parameter", "default", "meaning and range")
        for each, about in FORMULAS.items():
            parameters = about.parameters.items()
            names = [each, about.equation, *[""] * len(parameters)]
            for shown, (key, its) in zip(names, parameters, strict=False):
                table.add_row(shown, key, its.default, f"{its.meaning}; {its.low} to {its.high}")
            table.add_section()
        Console().print(table)
        return
    found = evaluate(name, values or [])
    head = [
        f"{key} ({parameter.unit})" if parameter.unit else key
        for key, parameter in found.formula.parameters.items()
    ]
    rows = [
        [f"{value:.6g}" for value in row]
        for row in zip(*found.values.values(), found.result, strict=True)
    ]
    if csv:
        for row in ([*head, found.formula.gives], *rows):
            typer.echo(",".join(row))
        return
    table = Table(*head, found.formula.gives, title=f"{name}, {found.formula.equation}")
    for row in rows:  # few digits, so the widest row fits 80 columns
        table.add_row(*row[:-1], f"{float(row[-1]):.4g}")
    Console().print(table)
