"""Names, units and colours of history columns and fields in figures and pages."""

from __future__ import annotations

from iceslide_fem.film.contact_age import CONTACT_AREA
from iceslide_fem.film.viscosity import FILM_VISCOSITY
from iceslide_fem.runtime.columns import Quantity, field_of

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE = "#CC79A7"
NO_CONTACT = "#D9D9D9"
EDGES = "#595959"  # of a mesh's cells
ICE = "#D6ECF8"
# Percentile at which colours end, because pressures are singular at an edge.
ROBUST = 98.0
FRICTION = Quantity("mu", "Friction coefficient", symbol="μ")
HEIGHT = Quantity("film_height_m", "Height of the water film", "nm", "h", "YlGnBu")
WARMTH = Quantity("surface_temperature_C", "Temperature of the ice surface", "°C", "T", "inferno")
SQUEEZED = Quantity("squeezed_height_m", "Water squeezed into the roughness", "µm", "Hₛ")
VISCOSITY = Quantity(FILM_VISCOSITY, "Viscosity of the film's water", "mPa s", "η")
AREA = Quantity(CONTACT_AREA, "Real contact area at the contact's age", symbol="k")
LOADS = (
    Quantity("nominal_pressure_Pa", "Nominal pressure", "bar", "p"),
    Quantity("speed_m_per_s", "Sliding speed", "m/s", "v"),
)
CONTACT = Quantity("contact_pressure_Pa", "Contact pressure", "bar")
STRESS = Quantity("von_Mises_stress_Pa", "Von Mises stress", "bar", colours="Oranges")
PRESSURE, MISES, TEMPERATURE = CONTACT.name, STRESS.name, field_of("temperature_C")
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


def energy_unit(largest: float) -> str:
    """The unit of ENERGIES in which `largest` (J) is at least 1, or the smallest unit."""
    return next((unit for unit, factor in ENERGIES.items() if factor * largest >= 1.0), "nJ")
