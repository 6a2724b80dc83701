"""Names, units and colours of history columns and fields in figures and pages."""

from __future__ import annotations

from typing import NamedTuple

from iceslide_fem.film.contact_age import CONTACT_AREA
from iceslide_fem.film.viscosity import FILM_VISCOSITY
from iceslide_fem.scene.materials import BAR

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, BLACK = "#CC79A7", "#222222"
NO_CONTACT = "#D9D9D9"
EDGES = "#595959"  # of a mesh's cells
ICE = "#D6ECF8"
MELTING, SATURATED = "#E3EFF9", "#FCEBD3"  # shades of the phases of a film


# Percentile at which colours end, because pressures are singular at an edge.
ROBUST = 98.0


class Quantity(NamedTuple):
    """Display of a history column: title, axis label, factor to its unit."""

    column: str
    title: str
    axis: str
    factor: float


FRICTION = Quantity("mu", "Friction coefficient", "μ (1)", 1.0)
HEIGHT = Quantity("film_height_m", "Height of the water film", "h (nm)", 1e9)
WARMTH = Quantity("surface_temperature_C", "Temperature of the ice surface", "T (°C)", 1.0)
SQUEEZED = Quantity("squeezed_height_m", "Water squeezed into the roughness", "Hₛ (µm)", 1e6)
VISCOSITY = Quantity(FILM_VISCOSITY, "Viscosity of the film's water", "η (mPa s)", 1e3)
AREA = Quantity(CONTACT_AREA, "Real contact area at the contact's age", "k (1)", 1.0)
LOADS = {  # by keys of the scene
    "pressure": Quantity("nominal_pressure_Pa", "Nominal pressure", "p (bar)", 1.0 / BAR),
    "speed": Quantity("speed_m_per_s", "Sliding speed", "v (m/s)", 1.0),
}
SHARES = {  # columns of the history, and their names
    "contact_fraction": "contact / nominal area",
    "melted_fraction": "melted / contact",
    "saturated_fraction": "saturated / contact",
}
BALANCE = {
    "friction_work_J": "work of friction",
    "ice_heat_J": "warms the ice",
    "latent_heat_J": "melts ice",
    "rubber_heat_J": "warms the rubber",
    "elastic_energy_J": "stored in the rubber",
}
ENERGIES = {"J": 1.0, "mJ": 1e3, "µJ": 1e6, "nJ": 1e9}  # unit: how many are a joule


class FieldQuantity(NamedTuple):
    """Display of a field: name in files, title, unit and factor to it, colours."""

    name: str
    title: str
    unit: str
    factor: float
    colours: str


PRESSURE, MISES = "contact pressure (Pa)", "von Mises stress (Pa)"
TEMPERATURE = "temperature (degC)"
CONTACT = FieldQuantity(PRESSURE, "Contact pressure", "bar", 1.0 / BAR, "viridis")
STRESS = FieldQuantity(MISES, "Von Mises stress", "bar", 1.0 / BAR, "Oranges")
FILM = FieldQuantity("film height (m)", HEIGHT.title, "nm", 1e9, "YlGnBu")
SURFACE = FieldQuantity("surface temperature (degC)", WARMTH.title, "°C", 1.0, "inferno")


def energy_unit(largest: float) -> str:
    """The unit of ENERGIES in which `largest` (J) is at least 1, or the smallest unit."""
    return next((unit for unit, factor in ENERGIES.items() if factor * largest >= 1.0), "nJ")
