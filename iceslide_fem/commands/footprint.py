"""`iceslide footprint`: from a picture, a map or a line of pressures to friction."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.commands.report import NoReport, leave_report
from iceslide_fem.runtime.launch import imports_that_stay
from iceslide_fem.runtime.options import Force, Text, folder_option, option


def footprint(
    image: Annotated[
        Path | None,
        typer.Argument(metavar="IMAGE", help="PNG, JPEG or TIFF.", show_default=False),
    ] = None,
    pressure_map: Annotated[
        Text, option("FILE", "Pressures, .npy, text or a sensor's frames, instead of a picture.")
    ] = None,
    pressure_unit: Annotated[
        Text, option("UNIT", "Of pressures whose file does not say: kPa, bar, psi.", "Pa")
    ] = None,
    frame: Annotated[Text, option("N", "Of a sensor's file.", "that of the largest force")] = None,
    line: Annotated[
        Text, option("CSV", "One line: columns x_m, pressure_Pa, perhaps temperature_C, state.")
    ] = None,
    gaussian: Annotated[
        Text, option("L,PEAK,SIGMA", "One line: a Gaussian, say 180mm,4bar,30mm.")
    ] = None,
    row: Annotated[Text, option("N", "One line: row N of the pixels, from the top.")] = None,
    temperature_map: Annotated[
        Text, option("FILE", "Temperatures of the ice in degC, for module 3.")
    ] = None,
    state_map: Annotated[
        Text, option("FILE", "States for module 3: 1 dry, 2 mixed, 3 wet.")
    ] = None,
    length: Annotated[Text, option("M", "Size along the direction of travel: 180mm.")] = None,
    width: Annotated[Text, option("M", "Size across it; both of the cropped picture.")] = None,
    max_pressure: Annotated[Text, option("PA", "High end of the scale: 5bar.")] = None,
    min_pressure: Annotated[Text, option("PA", "Low end of the scale.", "0bar")] = None,
    threshold: Annotated[
        Text,
        option(
            "PA", "No contact up to here.", "5 % of the scale above its low end; of numbers 1 Pa"
        ),
    ] = None,
    dark_is: Annotated[
        Text, option("WHAT", "Pressure where a grey picture is dark: high (an ink print) or low.")
    ] = None,
    colormap: Annotated[Text, option("NAME", "A colour map of matplotlib; else grey.")] = None,
    legend: Annotated[
        Text, option("L,T,R,B", "Box of the colour bar in the picture, in pixels.")
    ] = None,
    background: Annotated[
        Text, option("COLOUR", "Colour of no contact beside the bar, or none.", "white")
    ] = None,
    rotation: Annotated[
        Text, option("DEG", "Counter-clockwise, to turn the direction of travel to the right.")
    ] = None,
    crop: Annotated[
        Text, option("L,T,R,B", "Box of the footprint after rotation, in pixels.")
    ] = None,
    load: Annotated[Text, option("N", "Wheel load to scale the pressures to: 3kN.")] = None,
    speed: Annotated[Text, option("M/S", "Speed of the vehicle.", "3m/s")] = None,
    slip: Annotated[
        Text, option("S", "Slip ratio of film and moving source.", "1, a locked wheel")
    ] = None,
    water_speed: Annotated[
        Text, option("S", "Of squeezed-out water on the rubber, over that of the ice.", "1")
    ] = None,
    temperature: Annotated[Text, option("T", "Temperature of the ice.", "-4degC")] = None,
    compound: Annotated[Text, option("NAME", "Rubber compound.", "B")] = None,
    contact: Annotated[
        Text, option("CSV", "Table of k, D, H_V over pressure instead of the compound's.")
    ] = None,
    static_friction: Annotated[Text, option("MU", "mu_st of (3.2).", "0.1")] = None,
    depth: Annotated[Text, option("M", "Depth d of (3.5) to (3.7).", "0.1mm")] = None,
    thesis_slip: Annotated[Text, option("S", "Slip in (3.2) for (3.3) alone.", "1e-5")] = None,
    thesis_time: Annotated[Text, option("S", "Time t in (3.3).", "1s")] = None,
    air_temperature: Annotated[
        Text, option("T", "Of air and tread before they touch, in (3.6).", "that of the ice")
    ] = None,
    ice_material: Annotated[
        Text,
        option("K,RHO,C", "Of the ice, SI units.", "2.22,917.8,2020; below the film 2.25,916,2220"),
    ] = None,
    tread_material: Annotated[
        Text, option("K,RHO,C", "Of the macroscopic model, SI units.", "0.19,940,1500")
    ] = None,
    water_conductivity: Annotated[Text, option("W/(m K)", "In (3.7).", "0.56")] = None,
    viscosity: Annotated[
        Text,
        option("PA*S", "Of the film's water; or a CSV file of it over temperature.", "1.8mPa*s"),
    ] = None,
    initial_height: Annotated[Text, option("M", "Of the film at first.", "70nm")] = None,
    dry_stress: Annotated[
        Text,
        option("PA", "Of dry rubber on ice, the film's limit; or a CSV file over temperature."),
    ] = None,
    contact_age: Annotated[
        Text, option("SCENE", "Whose contact ages: its k, D and H_V, instead of the compound's.")
    ] = None,
    dry_softening: Annotated[Text, option("K", "Over which a number of it falls.")] = None,
    dry_residual: Annotated[Text, option("K", "Above melting where it is 0.", "0.5K")] = None,
    melting_temperature: Annotated[Text, option("T", "Of the ice, as of salt.", "0degC")] = None,
    latent_heat: Annotated[Text, option("J/KG", "Of melting.", "330kJ/kg")] = None,
    aggregate: Annotated[Text, option("G/M2", "Spread on the ice, in (1.2).", "0")] = None,
    tolerance: Annotated[Text, option("X", "Relative error of the film's mu.", "1e-2")] = None,
    scenes: Annotated[Text, option("N", "Write scenes of N representative blocks.", "0")] = None,
    tread_height: Annotated[Text, option("M", "Height of their blocks.", "8mm")] = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name of the picture>.")
    ] = None,
    force: Force = False,
    no_report: NoReport = False,
) -> None:
    """Temperature, water film and friction under a tyre, from its footprint or a line along it."""
    values = {name: value for name, value in locals().items() if value is not None}
    force, no_report = values.pop("force"), values.pop("no_report")
    source = image or pressure_map or line or ("gaussian" if gaussian else "footprint")
    directory = values.pop("out", Path("results") / Path(source).stem)

    with imports_that_stay():
        from rich.console import Console
        from rich.table import Table

        from iceslide_fem.preprocess.footprint.command import run
        from iceslide_fem.preprocess.footprint.summary import lines

    figures = run(values, directory, force)
    table = Table(show_header=False)
    for name, value in lines(figures):
        table.add_row(name, value)
    Console().print(table)
    for warning in figures["warnings"]:
        typer.echo(f"Note: {warning}.")
    if not no_report:
        leave_report(directory)
    for pattern in (
        "*.png",
        "line.csv",
        "footprint.vti",
        "*.html",
        "summary.json",
        "scenes/block_*",
    ):
        for path in sorted(directory.glob(pattern)):
            typer.echo(str(path))
