"""What all figures share: colours, and how the fields of the interface are shown.

Colours are those of Okabe and Ito, which the colour-blind tell apart.
"""

from typing import NamedTuple

from iceslide_fem.scene.materials import BAR

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, BLACK = "#CC79A7", "#222222"
NO_CONTACT = "#D9D9D9"
EDGES = "#595959"  # of a mesh's cells
ICE = "#D6ECF8"
MELTING, SATURATED = "#E3EFF9", "#FCEBD3"  # shades of the phases of a film
# Percentile of the facets' values at which colours end: pressures are singular at an edge.
ROBUST = 98.0


class FieldQuantity(NamedTuple):
    """A field as it is shown: its name in the files, title, unit and factor to it, colours."""

    name: str
    title: str
    unit: str
    factor: float
    colours: str


PRESSURE, MISES = "contact pressure (Pa)", "von Mises stress (Pa)"
TEMPERATURE = "temperature (degC)"
CONTACT = FieldQuantity(PRESSURE, "Contact pressure", "bar", 1.0 / BAR, "viridis")
STRESS = FieldQuantity(MISES, "Von Mises stress", "bar", 1.0 / BAR, "Oranges")
FILM = FieldQuantity("film height (m)", "Height of the water film", "nm", 1e9, "YlGnBu")
SURFACE = FieldQuantity(
    "surface temperature (degC)", "Temperature of the ice surface", "°C", 1.0, "inferno"
)
