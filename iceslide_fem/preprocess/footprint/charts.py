"""Charts of a footprint: maps, curves along a line, and mean friction compared with formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iceslide_fem.film.doubts import LARGEST_FRICTION as MOST
from iceslide_fem.postprocess.report.page import Chart, Curve, HeatMap
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import HEIGHT, Quantity, field_of
from iceslide_fem.scene.materials import BAR

MM = 1e3
X, Y = "x (mm), the tyre moves to the right", "y (mm)"
STATES = ("dry", "mixed", "wet")
CONTACT, PRESSURE, SHEAR, MU = "contact", "pressure_Pa", "shear_stress_Pa", "mu"
OUTSIDE, STATE = "outside_table", "state"
# Maps by pictures.
MAPS = {
    "pressure": Quantity(PRESSURE, "Contact pressure", "bar"),
    "mu": Quantity(MU, f"Friction coefficient, film law, up to {MOST:g}", colours="magma"),
    "temperature": Quantity(
        "surface_temperature_C", "Temperature of the ice, film law", "°C", colours="inferno"
    ),
    "film_height": HEIGHT,
    "wet_dry": Quantity(STATE, "State of the ice, film law", colours="cividis"),
}
# Those of the thesis's model, in one picture.
OF_MODELS = (
    Quantity("rise_thesis_K", "Temperature rise by (3.3)", "K", colours="inferno"),
    Quantity("mu_thesis", "mu by (4.7) to (4.9), (3.3)", colours="magma"),
    Quantity("rise_moving_K", "Temperature rise, moving source", "K", colours="inferno"),
    Quantity("mu_moving", "mu by (4.7) to (4.9), moving source", colours="magma"),
)
# Names in footprint.vti that say more than their columns.
_SAID = {
    STATE: "state (0 none, 1 dry, 2 mixed, 3 wet)",
    OUTSIDE: "outside the table",
    "squeezed_height_m": "squeezed-out height (m)",
    "water_pressure_Pa": "pressure of the water (Pa)",
    "distance_to_colours": "distance to the colour bar",
    "rise_thesis_K": "rise by (3.3) (K)",
    "rise_moving_K": "rise by the moving source (K)",
    "rise_given_K": "rise as given (K)",
    "mu_thesis": "mu by (4.7) to (4.9), (3.3)",
    "mu_moving": "mu by (4.7) to (4.9), moving source",
    "mu_given": "mu by (4.7) to (4.9), as given",
}
# Curves of a line by name, and their columns in line.csv.
ALONG = {"(3.3)": "thesis", "moving source": "moving", "given": "given", "film law": "film"}
# Charts of a line: anchor, title, label of y, column, and logarithmic axes.
OF_A_LINE = (
    ("flux", "Heat flux by (3.2)", "W/m²", "flux_{}_W_m2", "y"),
    ("rise", "Temperature rise", "K", "rise_{}_K", ""),
    ("temperature", "Temperature of the ice's surface", "°C", "temperature_{}_C", ""),
    ("height", "Height of the water film", "nm", "{}_height_m", ""),
    ("state", "Dry (1), mixed (2), wet (3)", "state", "state_{}", ""),
    ("mu", f"Friction coefficient up to {MOST:g}", "mu (1)", "mu_{}", "y"),
)
# Curves over the ice's temperature, columns of comparison.csv.
FORMULAS = {
    "mu_film": "film law under every pixel",
    "mu_navin": "Navin (1.2)",
    "mu_peng": "Peng (1.7), weights put right",
    "mu_hayhoe": "Hayhoe and Shapley (1.3) to (1.5)",
}


def map_name(column: str) -> str:
    """Name in footprint.vti of a map's column."""
    return _SAID.get(column) or field_of(column).removesuffix(" (1)")


def charts_of_area(
    maps: Mapping[str, NDArray[Any]],
    pixel: tuple[float, float],
    comparison: Mapping[str, ArrayLike],
) -> Mapping[str, Sequence[Chart | HeatMap]]:
    """Charts by the names of pictures; pixel: size along x and y, m."""
    contact = maps[CONTACT] > 0
    places = tuple(
        MM * size * (np.arange(count) + 0.5)
        for size, count in zip(pixel, contact.shape[::-1], strict=True)
    )
    found: dict[str, Sequence[Chart | HeatMap]] = {
        name: [_map(maps, contact, places, name, each)] for name, each in MAPS.items()
    }
    if OF_MODELS[0].column in maps:
        found["thesis"] = [
            _map(maps, contact, places, f"model-{number}", each)
            for number, each in enumerate(OF_MODELS)
        ]
    along = [
        Curve("pressure, mean of all rows", places[0], maps[PRESSURE].mean(axis=0) / BAR),
        Curve("friction stress", places[0], maps[SHEAR].mean(axis=0) / BAR, 1),
    ]
    says = "Means over y, gaps between blocks included"
    found["along"] = [Chart("along", "From trailing to leading edge", says, X, "bar", along)]
    return found | {"comparison": [_comparison(comparison)]}


def _map(
    maps: Mapping[str, NDArray[Any]],
    contact: NDArray[Any],
    places: tuple[Array, ...],
    anchor: str,
    shown: Quantity,
) -> HeatMap:
    """A map of a footprint, without a value beside the contact."""
    name, title, unit, _, tint = shown
    values = np.where(contact, shown.factor * maps[name], np.nan)
    says = (
        f"Between {np.nanmin(values):.4g} and {np.nanmax(values):.4g} {unit}, mean of the "
        f"pixels {np.nanmean(values):.4g} {unit}".replace(" ,", ",").strip()
    )
    limits, marked, classes = None, None, STATES if name == STATE else ()
    if name == STATE:
        limits = 1.0, 3.0
        parts = ((values == 1 + i).sum() / contact.sum() for i in range(len(STATES)))
        says = ", ".join(f"{part:.0%} {one}" for part, one in zip(parts, STATES, strict=True))
    if anchor == MU or title.startswith("mu"):
        limits = 0.0, min(MOST, float(np.nanmax(values)))
        more = float((values[contact] > MOST).mean())
        says += f"; above {MOST:g} on {more:.1%} of the contact" if more else ""
    if anchor in ("pressure", MU) and maps[OUTSIDE].any():
        marked = maps[OUTSIDE]
        part = float((marked[contact] > 0).mean())
        says += f"; outside the table of k, D and H_V on {part:.1%} of the contact (hatched, grey)"
    return HeatMap(
        anchor, title, says, X, Y, unit, (places[0], places[1]), values, tint, True, limits,
        classes, marked,
    )  # fmt: skip


def _comparison(table: Mapping[str, ArrayLike]) -> Chart:
    """Mean mu over the temperature of the ice, beside the formulas of chapter 2."""
    curves = [
        Curve(name, table["temperature_C"], table[column], look)
        for look, (column, name) in enumerate(FORMULAS.items())
    ]
    says = "The formulas are of other tyres and ice; they say how far friction varies"
    title, x = "Mean friction over the temperature of the ice", "temperature of the ice (°C)"
    return Chart("comparison", title, says, x, "mean mu (1)", curves)


def charts_of_line(table: Mapping[str, Array]) -> Mapping[str, Sequence[Chart]]:
    """Charts by the name of the one picture; table: columns of line.csv."""
    pressure = {"pressure": table["pressure_Pa"] / BAR}
    drawn = [_chart("pressure", "Contact pressure", "bar", MM * table["x_m"], pressure, "")]
    for anchor, title, label, column, logarithmic in OF_A_LINE:
        names = {name: column.format(key) for name, key in ALONG.items()}
        factor = 1e9 if anchor == "height" else 1.0
        curves = {name: factor * table[key] for name, key in names.items() if key in table}
        if anchor == "mu":
            curves = {
                name: np.where((mu > 0.0) & (mu <= MOST), mu, np.nan) for name, mu in curves.items()
            }
        curves = {name: values for name, values in curves.items() if np.isfinite(values).any()}
        if curves:
            drawn.append(_chart(anchor, title, label, MM * table["x_m"], curves, logarithmic))
    return {"line": drawn}


def _chart(
    anchor: str, title: str, label: str, x: Array, columns: Mapping[str, Array], logarithmic: str
) -> Chart:
    says = "; ".join(
        f"{name} at most {np.nanmax(y):.4g} at {x[int(np.nanargmax(y))]:.4g} mm"
        for name, y in columns.items()
    )
    curves = [Curve(name, x, y, look) for look, (name, y) in enumerate(columns.items())]
    return Chart(anchor, title, says, X, label, curves, logarithmic=logarithmic)
