"""`iceslide footprint`: from a picture, a map or a line of pressures to friction."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.commands import footprint_options as options
from iceslide_fem.commands.report import NoReport, leave_report
from iceslide_fem.runtime.launch import imports_that_stay
from iceslide_fem.runtime.options import Force, Text, folder_option, option
from iceslide_fem.runtime.terminal import show_figures, show_notes


def footprint(
    image: options.Image = None,
    pressure_map: options.PressureMap = None,
    pressure_unit: options.PressureUnit = None,
    frame: options.Frame = None,
    line: options.Line = None,
    gaussian: options.Gaussian = None,
    row: options.Row = None,
    thesis_balance: Annotated[
        bool,
        typer.Option(
            "--thesis-balance", help="The thesis's macroscopic model, too: (3.3), and its balance."
        ),
    ] = False,
    temperature_map: Annotated[
        Text, option("FILE", "Temperatures of the ice in degC, for module 3.")
    ] = None,
    state_map: Annotated[
        Text, option("FILE", "States for module 3: 1 dry, 2 mixed, 3 wet.")
    ] = None,
    length: options.Length = None,
    width: options.Width = None,
    max_pressure: options.MaxPressure = None,
    min_pressure: options.MinPressure = None,
    threshold: options.Threshold = None,
    dark_is: options.DarkIs = None,
    colormap: options.Colormap = None,
    legend: options.Legend = None,
    background: options.Background = None,
    rotation: options.Rotation = None,
    crop: options.Crop = None,
    load: options.Load = None,
    speed: Annotated[Text, option("M/S", "Speed of the vehicle.", "3m/s")] = None,
    slip: Annotated[
        Text, option("S", "Slip ratio of film and moving source.", "1, a locked wheel")
    ] = None,
    water_speed: options.WaterSpeed = None,
    temperature: options.Temperature = None,
    compound: options.Compound = None,
    contact: options.Contact = None,
    static_friction: Annotated[Text, option("MU", "mu_st of (3.2).", "0.1")] = None,
    depth: Annotated[Text, option("M", "Depth d of (3.5) to (3.7).", "0.1mm")] = None,
    thesis_slip: Annotated[Text, option("S", "Slip in (3.2) for (3.3) alone.", "1e-5")] = None,
    thesis_time: Annotated[Text, option("S", "Time t in (3.3).", "1s")] = None,
    air_temperature: Annotated[
        Text, option("T", "Of air and tread before they touch, in (3.6).", "that of the ice")
    ] = None,
    ice_material: options.IceMaterial = None,
    tread_material: Annotated[
        Text, option("K,RHO,C", "Of the macroscopic model, SI units.", "0.19,940,1500")
    ] = None,
    water_conductivity: Annotated[Text, option("W/(m K)", "In (3.7).", "0.56")] = None,
    viscosity: options.Viscosity = None,
    initial_height: options.InitialHeight = None,
    dry_stress: options.DryStress = None,
    contact_age: options.ContactAge = None,
    dry_softening: options.DrySoftening = None,
    dry_residual: options.DryResidual = None,
    melting_temperature: options.MeltingTemperature = None,
    latent_heat: options.LatentHeat = None,
    water: options.Water = None,
    lug: options.Lug = None,
    aggregate: Annotated[Text, option("G/M2", "Spread on the ice, in (1.2).", "0")] = None,
    tolerance: options.Tolerance = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name of the picture>.")
    ] = None,
    force: Force = False,
    no_report: NoReport = False,
) -> None:
    """Temperature, water film and friction under a tyre, from its footprint or a line along it."""
    values = {name: value for name, value in locals().items() if value is not None}
    force, no_report = values.pop("force"), values.pop("no_report")

    with imports_that_stay():
        from iceslide_fem.preprocess.footprint.command import run
        from iceslide_fem.preprocess.footprint.source_options import results_folder
        from iceslide_fem.preprocess.footprint.summary import lines

    directory = values.pop("out", results_folder(values))
    _, figures = run(values, directory, force)
    show_figures(lines(figures))
    show_notes(figures["warnings"])
    if not no_report:
        leave_report(directory)
    for pattern in ("*.png", "line.csv", "footprint.vti", "*.html", "summary.json"):
        for path in sorted(directory.glob(pattern)):
            typer.echo(str(path))
