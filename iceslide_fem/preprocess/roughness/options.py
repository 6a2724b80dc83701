"""The options of `iceslide roughness`; nothing heavy is imported before they are read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.runtime.options import Force, Text, folder_option, option
from iceslide_fem.runtime.terminal import show_figures, show_notes


def roughness(
    surface: Annotated[
        Path,
        typer.Argument(
            metavar="SURFACE",
            help="Height map of the rubber (.npy, text, .x3p, instruments' formats), or a "
            "surface.toml that generates one.",
            show_default=False,
        ),
    ],
    compound: Annotated[Text, option("NAME", "Rubber: A, B or C.", "B")] = None,
    modulus: Annotated[Text, option("PA", "Rubber: Young's modulus, 1.6MPa.")] = None,
    scene: Annotated[Text, option("TOML", "Rubber: that of a scene.")] = None,
    pressures: Annotated[
        Text, option("P:P:N", "First, last, count; in equal ratios.", "0.2bar:20bar:12")
    ] = None,
    realisations: Annotated[Text, option("N", "Of a generated surface.", "8")] = None,
    definition: Annotated[
        Text, option("NAME", "Of k and D: hydrodynamic or thesis.", "hydrodynamic")
    ] = None,
    shortest_wave: Annotated[
        Text, option("M", "Remove shorter waves.", "35um for a map, with hydrodynamic")
    ] = None,
    age: Annotated[
        Text, option("S,...", "After loading, of rubber that relaxes: 1ms,5ms; a table each.")
    ] = None,
    prony: Annotated[
        Text, option("G:TAU,...", "Arms, 0.3:5ms,0.2:1ms, or a rubber.toml or scene with them.")
    ] = None,
    modulus_is: Annotated[
        Text, option("NAME", "The rubber's, with --prony: instantaneous or long-term.")
    ] = None,
    wlf: Annotated[Text, option("C1,C2,T", "Shift of the arms' times: 7.4,121.6,20degC.")] = None,
    temperature: Annotated[Text, option("T", "Of the rubber, for that shift: -4degC.")] = None,
    pixel: Annotated[Text, option("M", "Pixel of a map that does not say: 17.5um.")] = None,
    height_unit: Annotated[Text, option("UNIT", "Of lengths that do not say: um.", "m")] = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name of the surface>.")
    ] = None,
    force: Force = False,
) -> None:
    """k, D and H_V over pressure, from a height map of the rubber: contact.csv for film.contact."""
    values = {name: value for name, value in locals().items() if value is not None}
    directory, force = values.pop("out", Path("results") / surface.stem), values.pop("force")
    if "age" in values:
        values["ages"] = values.pop("age")

    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.preprocess.roughness.command import lines, rows, run, table_name

    results, figures = run(values, directory, force)
    show_figures(lines(figures))
    for result in results:
        title = None if result.age is None else f"{1e3 * result.age:g} ms after loading"
        found = Table("p (bar)", "k", "D (um)", "H_V (um)", "k/D (1/mm)", title=title)
        for row in rows(result):
            found.add_row(*row)
        Console().print(found)
    show_notes(figures["warnings"])
    typer.echo(
        "Note: k and D hold for the shortest wave that is kept; with shorter ones both are "
        "smaller, and mean friction changes much less (docs/explanation/roughness.md)."
    )
    pictures = ("map.png", "contact.png", "parameters.png", "spectrum.png")
    tables = (table_name(result, results) for result in results)
    for name in (*tables, "surface.json", *pictures):
        typer.echo(str(directory / name))
