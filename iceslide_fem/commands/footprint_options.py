"""Options on pressures and film shared by the commands on footprints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iceslide_fem.runtime.options import Text, option

# --- where pressures come from

Image = Annotated[
    Path | None,
    typer.Argument(metavar="IMAGE", help="PNG, JPEG or TIFF.", show_default=False),
]
PressureMap = Annotated[
    Text,
    option(
        "FILE", "Pressures, .npy, text, points x, y or a sensor's frames, instead of a picture."
    ),
]
PressureUnit = Annotated[
    Text, option("UNIT", "Of pressures whose file does not say: kPa, bar, psi.", "Pa")
]
Frame = Annotated[Text, option("N", "Of a sensor's file.", "that of the largest force")]
Line = Annotated[
    Text,
    option(
        "CSV",
        "One line: points x_m, or cells cell_m, and pressure_Pa, perhaps temperature_C, state.",
    ),
]
Gaussian = Annotated[Text, option("L,PEAK,SIGMA", "One line: a Gaussian, say 180mm,4bar,30mm.")]
Row = Annotated[Text, option("N", "One line: row N of the pixels, from the top.")]
Length = Annotated[Text, option("M", "Size along the direction of travel: 180mm.")]
Width = Annotated[Text, option("M", "Size across it; both of the cropped picture.")]
MaxPressure = Annotated[Text, option("PA", "High end of the scale: 5bar.")]
MinPressure = Annotated[Text, option("PA", "Low end of the scale.", "0bar")]
Threshold = Annotated[
    Text,
    option("PA", "No contact up to here.", "5 % of the scale above its low end; of numbers 1 Pa"),
]
DarkIs = Annotated[
    Text, option("WHAT", "Pressure where a grey picture is dark: high (an ink print) or low.")
]
Colormap = Annotated[Text, option("NAME", "A colour map of matplotlib; else grey.")]
Legend = Annotated[Text, option("L,T,R,B", "Box of the colour bar in the picture, in pixels.")]
Background = Annotated[
    Text, option("COLOUR", "Colour of no contact beside the bar, or none.", "white")
]
Rotation = Annotated[
    Text, option("DEG", "Counter-clockwise, to turn the direction of travel to the right.")
]
Crop = Annotated[Text, option("L,T,R,B", "Box of the footprint after rotation, in pixels.")]
Load = Annotated[Text, option("N", "Wheel load to scale the pressures to: 3kN.")]

# --- the film and the ice below it

Temperature = Annotated[Text, option("T", "Temperature of the ice.", "-4degC")]
WaterSpeed = Annotated[
    Text, option("S", "Of squeezed-out water on the rubber, over that of the ice.", "1")
]
Compound = Annotated[Text, option("NAME", "Rubber compound.", "B")]
Contact = Annotated[
    Text, option("CSV", "Table of k, D, H_V over pressure instead of the compound's.")
]
IceMaterial = Annotated[
    Text,
    option("K,RHO,C", "Of the ice, SI units.", "2.22,917.8,2020; below the film 2.25,916,2220"),
]
Viscosity = Annotated[
    Text,
    option("PA*S", "Of the film's water; or a CSV file of it over temperature.", "1.8mPa*s"),
]
InitialHeight = Annotated[Text, option("M", "Of the film at first.", "70nm")]
DryStress = Annotated[
    Text,
    option("PA", "Of dry rubber on ice, the film's limit; or a CSV file over temperature."),
]
ContactAge = Annotated[
    Text, option("SCENE", "Whose contact ages: its k, D and H_V, instead of the compound's.")
]
DrySoftening = Annotated[Text, option("K", "Over which a number of it falls.")]
DryResidual = Annotated[Text, option("K", "Above melting where it is 0.", "0.5K")]
MeltingTemperature = Annotated[Text, option("T", "Of the ice, as of salt.", "0degC")]
LatentHeat = Annotated[Text, option("J/KG", "Of melting.", "330kJ/kg")]
Water = Annotated[
    Text, option("M", "That the ice brings: 20um; then full voids carry. 0um: they carry without.")
]
Lug = Annotated[
    Text, option("M", "That it flows out of, along the wheel.", "a block's, or the footprint's")
]
Tolerance = Annotated[Text, option("X", "Relative error of the film's mu.", "1e-2")]
