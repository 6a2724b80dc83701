"""`iceslide wheel`: friction over slip of a wheel, from its footprint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.commands import footprint_options as options
from iceslide_fem.commands.report import NoReport, leave_report
from iceslide_fem.runtime.launch import imports_that_stay
from iceslide_fem.runtime.options import Force, Text, folder_option, option
from iceslide_fem.runtime.terminal import show_figures, show_notes


def wheel(
    image: options.Image = None,
    pressure_map: options.PressureMap = None,
    pressure_unit: options.PressureUnit = None,
    frame: options.Frame = None,
    line: options.Line = None,
    gaussian: options.Gaussian = None,
    row: options.Row = None,
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
    speed: Annotated[Text, option("M/S", "Speed of the vehicle.", "50km/h")] = None,
    slip: Annotated[
        Text,
        option("A:B:N|S,...", "Slip ratios: 1 locked, 0 rolling, below 0 driven.", "0:1:21"),
    ] = None,
    slip_angle: Annotated[Text, option("ANGLE", "Of the wheel's motion to its plane.", "0")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=V,V",
            help="A family of curves over speed or temperature: speed=20km/h,50km/h. May be "
            "repeated.",
            show_default=False,
        ),
    ] = None,
    stiffness: Annotated[
        Text,
        option("auto|N/M2|PA/M", "Shear stiffness of the tread: of a patch, or per area.", "auto"),
    ] = None,
    tread_height: Annotated[Text, option("M", "Height of tread or blocks.", "8mm")] = None,
    pitch: Annotated[Text, option("M", "Of blocks along the wheel, edge to edge: 28mm.")] = None,
    groove: Annotated[Text, option("M", "Between two of them: 8mm.")] = None,
    abs_: Annotated[
        bool,
        typer.Option(
            "--abs", help="Brake a quarter car, too: locked, by thresholds of slip, at the peak."
        ),
    ] = False,
    end_speed: Annotated[Text, option("M/S", "Where a stop ends.", "5km/h")] = None,
    mass: Annotated[
        Text, option("KG", "Of the quarter car.", "what the load weighs; of a line 350kg")
    ] = None,
    scene: Annotated[
        Text, option("SCENE", "Whose friction law, ice, water and rubber are taken instead.")
    ] = None,
    temperature: options.Temperature = None,
    water_speed: options.WaterSpeed = None,
    compound: options.Compound = None,
    contact: options.Contact = None,
    contact_age: options.ContactAge = None,
    ice_material: options.IceMaterial = None,
    viscosity: options.Viscosity = None,
    initial_height: options.InitialHeight = None,
    dry_stress: options.DryStress = None,
    dry_softening: options.DrySoftening = None,
    dry_residual: options.DryResidual = None,
    melting_temperature: options.MeltingTemperature = None,
    latent_heat: options.LatentHeat = None,
    water: options.Water = None,
    lug: options.Lug = None,
    tolerance: options.Tolerance = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name of the source>_wheel.")
    ] = None,
    force: Force = False,
    no_report: NoReport = False,
) -> None:
    """Friction over slip of a wheel that rolls and slips on ice, from its footprint or a line."""
    values = {name: value for name, value in locals().items() if value is not None}
    force, no_report = values.pop("force"), values.pop("no_report")
    if values.pop("abs_"):
        values["abs"] = True

    with imports_that_stay():
        from rich.console import Console
        from rich.table import Table

        from iceslide_fem.preprocess.footprint.source_options import results_folder
        from iceslide_fem.preprocess.wheel.command import OF_STOPS, WRITTEN, run
        from iceslide_fem.preprocess.wheel.output import MEMBER_HEAD, lines, member_cells

    directory = values.pop("out", results_folder(values, "_wheel"))
    _, figures = run(values, directory, force)
    show_figures(lines(figures))
    found = Table(*MEMBER_HEAD)
    for member in figures["curves"]:
        found.add_row(*member_cells(member))
    Console().print(found)
    if figures["stops"]:
        stops = Table("brake", "distance", "time", "deceleration")
        for name, stop in figures["stops"].items():
            cells = stop["distance_m"], stop["time_s"], stop["deceleration_m_s2"]
            units = ("m", "s", "m/s²")
            stops.add_row(name, *(f"{x:.4g} {u}" for x, u in zip(cells, units, strict=True)))
        Console().print(stops)
    show_notes(figures["warnings"])
    if not no_report:
        leave_report(directory)
    for name in (*WRITTEN, *OF_STOPS, "report.html"):
        if (directory / name).is_file():
            typer.echo(str(directory / name))
