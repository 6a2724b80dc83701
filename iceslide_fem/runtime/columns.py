"""Columns of results: a name with its unit as suffix, which CSV, arrays, fields and pages share."""

from __future__ import annotations

from typing import NamedTuple

# Suffixes of names (after the underscore), and their units.
UNITS = {
    "J_per_kg_K": "J/(kg K)",
    "W_per_m_K": "W/(m K)",
    "J_per_m3": "J/m^3",
    "kg_per_m3": "kg/m^3",
    "J_per_kg": "J/kg",
    "Pa_per_m": "Pa/m",
    "m_per_s": "m/s",
    "rad_s": "rad/s",
    "W_m2": "W/m^2",
    "m_s2": "m/s^2",
    "N_m": "N m",
    "Pa_s": "Pa s",
    "m_s": "m/s",
    "m3": "m^3",
    "m2": "m^2",
    "Pa": "Pa",
    "C": "degC",
    "J": "J",
    "K": "K",
    "N": "N",
    "m": "m",
    "s": "s",
}
_LONGEST_FIRST = sorted(UNITS, key=len, reverse=True)
# Units that results are shown in, and how many of them are one of the column's unit.
SHOWN_IN = {"nm": 1e9, "µm": 1e6, "mm": 1e3, "µs": 1e6, "ms": 1e3, "mPa s": 1e3, "bar": 1e-5}
SHOWN_IN |= {"%": 100.0, "km/h": 3.6}


def label_and_unit(column: str) -> tuple[str, str]:
    """Label and unit of a `column`: "film_height_m" is ("film height", "m").

    The unit is "1" without a suffix: for a pure number, a text or a count.
    """
    for ending in _LONGEST_FIRST:
        name = column.removesuffix(f"_{ending}")
        if name != column:
            return name.replace("_", " "), UNITS[ending]
    return column.replace("_", " "), "1"


def attributes_of(column: str) -> dict[str, str]:
    """Attributes of a labelled array that holds a `column`: `long_name` and `units`."""
    label, unit = label_and_unit(column)
    return {"long_name": label, "units": unit}


def field_of(column: str) -> str:
    """Name of a field with the values of a `column`: "film height (m)" for "film_height_m"."""
    return "{} ({})".format(*label_and_unit(column))


class Quantity(NamedTuple):
    """How a column, or a field with its values, is shown.

    title; unit to show it in, as in `SHOWN_IN` or the column's own; symbol; colours of maps.
    """

    column: str
    title: str
    unit: str = ""
    symbol: str = ""
    colours: str = "viridis"

    @property
    def factor(self) -> float:
        """How many of the shown unit are one of the column's."""
        return SHOWN_IN.get(self.unit, 1.0)

    @property
    def label(self) -> str:
        """Title and unit."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.symbol} ({self.unit or 1})"

    @property
    def name(self) -> str:
        """Name of the field."""
        return field_of(self.column)


FRICTION = Quantity("mu", "Friction coefficient", symbol="μ")
HEIGHT = Quantity("film_height_m", "Height of the water film", "nm", "h", "YlGnBu")
WARMTH = Quantity("surface_temperature_C", "Temperature of the ice surface", "°C", "T", "inferno")
SQUEEZED = Quantity("squeezed_height_m", "Water squeezed into the roughness", "µm", "Hₛ")
VISCOSITY = Quantity("film_viscosity_Pa_s", "Viscosity of the film's water", "mPa s", "η")
AREA = Quantity("contact_area_fraction", "Real contact area at the contact's age", symbol="k")
LOADS = (
    Quantity("nominal_pressure_Pa", "Nominal pressure", "bar", "p"),
    Quantity("speed_m_per_s", "Sliding speed", "m/s", "v"),
)
CONTACT = Quantity("contact_pressure_Pa", "Contact pressure", "bar")
STRESS = Quantity("von_Mises_stress_Pa", "Von Mises stress", "bar", colours="Oranges")
TEMPERATURE = Quantity("temperature_C", "Temperature of ice or rubber", "°C", "T", "inferno")
