"""Names of columns: a label, and a unit as suffix."""

from __future__ import annotations

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
