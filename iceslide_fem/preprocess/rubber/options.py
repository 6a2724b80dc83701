"""The options of `iceslide rubber`; nothing heavy is imported before they are read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.runtime.options import Force, Text, folder_option, option
from iceslide_fem.runtime.terminal import show_figures, show_notes


def rubber(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="DMA.csv|SCENE.toml",
            help="Table of frequency, temperature, storage modulus, and loss modulus or tan "
            "delta; or of time, temperature, relaxation modulus; or a scene, whose rubber is "
            "shown.",
            show_default=False,
        ),
    ],
    of: Annotated[Text, option("E|G", "What the moduli are of.", "as headings say, else E")] = None,
    strain: Annotated[Text, option("STRAIN", "Amplitude of the rows taken: 0.1%.", "all")] = None,
    temperature: Annotated[Text, option("T", "Of a table without temperatures: 20degC.")] = None,
    reference: Annotated[
        Text, option("T", "Of the master curve: 20degC.", "the isotherm nearest to 20degC")
    ] = None,
    shift: Annotated[
        Text,
        option("NAME", "wlf, arrhenius, or table: each isotherm's own factor.", "wlf"),
    ] = None,
    wlf: Annotated[
        Text, option("C1,C2,T", "Given instead of fitted: 7.4,121.6,20degC (log10, K).")
    ] = None,
    arrhenius_below: Annotated[Text, option("T", "Colder isotherms: an activation energy.")] = None,
    arms: Annotated[Text, option("N", "Most arms of the series, up to 60.", "20")] = None,
    modulus_is: Annotated[
        Text, option("NAME", "C10 written: instantaneous or long-term.", "long-term")
    ] = None,
    rates: Annotated[Text, option("R,...", "Of strain, drawn; 1/s.", "0.01,1,100")] = None,
    temperatures: Annotated[
        Text, option("T,...", "That are drawn.", "-20degC,0degC,20degC")
    ] = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name of the file>.")
    ] = None,
    force: Force = False,
) -> None:
    """Rubber that relaxes, from a DMA table: shifts, Prony series, a \\[rubber] for scenes."""
    values = {name: value for name, value in locals().items() if value is not None}
    directory, force = values.pop("out", Path("results") / source.stem), values.pop("force")
    if "of" in values:
        values["kind"] = values.pop("of")

    from iceslide_fem.preprocess.rubber.command import WRITTEN, lines, run

    figures = run(values, directory, force)
    show_figures(lines(figures))
    show_notes(figures["warnings"])
    for name in WRITTEN:
        typer.echo(str(directory / name))
