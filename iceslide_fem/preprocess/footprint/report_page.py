"""The page of a footprint: input, maps and lines, friction and edge temperatures."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.film.doubts import LARGEST_FRICTION
from iceslide_fem.postprocess.report.page import (
    Cell,
    Chart,
    Curve,
    HeatMap,
    Page,
    Section,
    Table,
    Text,
)
from iceslide_fem.postprocess.report.words import versions_of
from iceslide_fem.postprocess.results.run_directory import read_table
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR

ABOUT_ERROR = "The film law was advanced with a relative error of {:g} of mu per pixel."
OF_MODELS = (
    "The macroscopic model has no steps. Its d and t are tuned: docs/explanation/footprint.md says "
    "how far to believe it. Nothing melts in it, and the heat is that of static friction."
)
LEFT_OUT = (
    "The film law: the tread pattern stands still over the picture; heat does not spread sideways; "
    "k, D and H_V follow the local pressure."
)
PIXELS = 260  # largest number along x: every n-th pixel is drawn
MM = 1e3
TABLES = {"footprint": "The contact", "colours": "How the picture was read"}
MODELS = {
    "film": "film law",
    "thesis": "(3.3) as printed",
    "moving_source": "moving source",
    "given": "temperatures given",
}
# Names of rows of the models that differ from their keys.
NAMES = {
    "mu_mean": "mean mu",
    "mu_map_mean": "mean mu, (4.7) to (4.9)",
    "mu_balance": "mean mu, balance (3.8)",
    "peak_rise_K": "largest rise",
    "mean_film_height_m": "mean height of the film",
    "mean_surface_temperature_C": "mean temperature of the ice",
    "leading_edge_temperature_C": "leading edge",
    "trailing_edge_temperature_C": "trailing edge",
    "melting_share": "melting",
    "saturated_share": "free volume full",
    "mean_water_height_m": "mean height of the water",
    "water_borne_share": "load borne by water",
    "outside_table_share": "outside the table of k, D, H_V",
    "outside_table_friction_share": "friction outside the table",
    "dry_share": "dry",
    "mixed_share": "mixed",
    "wet_share": "wet",
    "median_distance": "median distance of a colour to the bar",
    "p95_distance": "95 % of the pixels are closer than",
    "far_share": "pixels farther than 0.15",
    "unclear_share": "pixels that took a neighbour's value",
    "net_to_gross": "net / gross area",
    "max_pressure_Pa": "largest pressure",
    "load_factor": "pressures were multiplied by",
}
UNITS = (
    ("_Pa", "bar", 1.0 / BAR),
    ("_m2", "cm²", 1e4),
    ("_N", "N", 1.0),
    ("_K", "K", 1.0),
    ("_C", "°C", 1.0),
    ("_W", "W", 1.0),
    ("water_height_m", "µm", 1e6),
    ("height_m", "nm", 1e9),
    ("_m", "mm", 1e3),
    ("share", "%", 100.0),
)
CONTACT, PRESSURE, SHEAR, MU = "contact", "pressure (Pa)", "shear stress (Pa)", "mu"
OUTSIDE = "outside the table"
STATE = "state (0 none, 1 dry, 2 mixed, 3 wet)"
MU_MOVING = "mu by (4.7) to (4.9), moving source"
# Cell data of footprint.vti: title, unit, factor, colours.
MAPS = {
    PRESSURE: ("Contact pressure", "bar", 1.0 / BAR, "viridis"),
    MU: (f"Friction coefficient, film law, up to {LARGEST_FRICTION:g}", "", 1.0, "magma"),
    "surface temperature (degC)": ("Temperature of the ice, film law", "°C", 1.0, "inferno"),
    "film height (m)": ("Height of the water film", "nm", 1e9, "YlGnBu"),
    STATE: ("Dry (1), mixed (2), wet (3), film law", "", 1.0, "cividis"),
}
MAPS_OF_MODELS = {
    "rise by (3.3) (K)": ("Temperature rise by (3.3)", "K", 1.0, "inferno"),
    "rise by the moving source (K)": ("Temperature rise, moving source", "K", 1.0, "inferno"),
    MU_MOVING: (MU_MOVING, "", 1.0, "magma"),
}
# Curves of a line by name, and their columns in line.csv.
ALONG = {"(3.3)": "thesis", "moving source": "moving", "given": "given", "film law": "film"}
# Charts of a line: anchor, title, label of y, and column.
CHARTS = (
    ("flux", "Heat flux by (3.2)", "W/m²", "flux_{}_W_m2"),
    ("rise", "Temperature rise", "K", "rise_{}_K"),
    ("temperature", "Temperature of the ice's surface", "°C", "temperature_{}_C"),
    ("state", "Dry (1), mixed (2), wet (3)", "state", "state_{}"),
    ("mu", "Friction coefficient", "mu (1)", "mu_{}"),
)


def page_of_footprint(folder: Path, summary: Mapping[str, Any]) -> Page:
    """The page of the footprint in `folder`. Raises SceneError if its files are damaged."""
    try:
        case, one_line = summary["case"], "line" in summary
        tables = [_table(summary[key], title) for key, title in TABLES.items() if key in summary]
        error = [Text(ABOUT_ERROR.format(case["tolerance"]))]
        error += [Text(OF_MODELS)] if case["thesis_balance"] else []
        warnings = [
            Text(f"{sentence[:1].upper()}{sentence[1:]}.", "warning")
            for sentence in summary.get("warnings", [])
        ]
        chosen = {key: value for key, value in case.items() if value is not None}
        rows = [[Cell(key), Cell(str(value))] for key, value in chosen.items()]
        options = Table("All options, SI units", ["option", "value"], rows)
        command, versions = Text(_command(case), "code"), versions_of({"": summary})
        charts = _lines(folder) if one_line else _maps(folder, case["thesis_balance"])
        return Page(
            title=f"{Path(summary['source']).stem}: {'line along a ' * one_line}footprint",
            summary=f"A tyre at {case['speed']:g} m/s with slip {case['slip']:g} on ice at "
            f"{case['temperature'] - ZERO_CELSIUS:.4g} °C. Mean friction by the film law: "
            f"{summary['film']['mu_mean']:.4f}. Ice comes in at the right, where the tyre moves "
            "to, and leaves at the left.",
            sections=[
                Section("results", "Results", [*tables, _models(summary), *error]),
                Section("warnings", "Warnings", warnings or [Text("There was no warning.")]),
                Section("curves", "Along the line" if one_line else "Maps", charts),
                Section("neglected", "What the models leave out", [Text(LEFT_OUT)]),
                Section("again", "Run it again", [command, options, versions]),
            ],
        )
    except (AttributeError, KeyError, OSError, TypeError, ValueError) as error:
        raise SceneError(f"{folder} holds no whole footprint ({error})") from None


def _table(entries: Mapping[str, Any], title: str) -> Table:
    rows = [
        [Cell(_name(key)), Cell(_text(key, value), key, value)]
        for key, value in entries.items()
        if isinstance(value, int | float)
    ]
    return Table(title, ["", ""], rows)


def _models(summary: Mapping[str, Any]) -> Table:
    """The film law and the macroscopic models side by side."""
    models = {name: summary[key] for key, name in MODELS.items() if key in summary}
    rows = []
    for key in {key: None for model in models.values() for key in model}:
        row, named = [Cell(_name(key))], False
        for model in models.values():
            if key not in model:
                row.append(Cell(""))
                continue
            text = _text(key, model[key])
            row.append(Cell(text) if named else Cell(text, key, model[key]))
            named = True
        rows.append(row)
    return Table("Friction and heat, by model", ["", *models], rows)


def _name(key: str) -> str:
    suffix = next((end for end, _, _ in UNITS if key.endswith(end) and end.startswith("_")), "")
    return NAMES.get(key, key.removesuffix(suffix).replace("_", " "))


def _text(key: str, value: float) -> str:
    for end, unit, factor in UNITS:
        if key.endswith(end):
            return f"{factor * value:.4g} {unit}"
    return f"{value:.4g}"


def _maps(folder: Path, with_models: bool) -> list[HeatMap | Chart]:
    from iceslide_fem.preprocess.footprint.map_file import read_maps

    path = folder / "footprint.vti"
    if not path.is_file():
        raise SceneError(f"{folder} holds no whole footprint (no footprint.vti)")
    shown = MAPS | (MAPS_OF_MODELS if with_models else {})
    maps, (dx, dy) = read_maps(path, {*shown, CONTACT, PRESSURE, SHEAR, OUTSIDE})
    contact = maps[CONTACT] > 0
    rows, columns = contact.shape
    stride = -(-columns // PIXELS)
    x, y = (np.arange(columns) + 0.5) * MM * dx, (np.arange(rows) + 0.5) * MM * dy
    drawn: list[HeatMap | Chart] = []
    for name, (title, unit, factor, tint) in shown.items():
        values = np.where(contact, factor * maps[name], np.nan)
        says = (
            f"Between {np.nanmin(values):.4g} and {np.nanmax(values):.4g} {unit}, mean of the "
            f"pixels {np.nanmean(values):.4g} {unit}".replace(" ,", ",").strip()
        )
        limits = None
        if name in (MU, MU_MOVING):
            limits = 0.0, min(LARGEST_FRICTION, float(np.nanmax(values)))
            more = float((values[contact] > LARGEST_FRICTION).mean())
            says += f"; above {LARGEST_FRICTION:g} on {more:.1%} of the contact" if more else ""
        if name == PRESSURE and maps[OUTSIDE].any():
            part = float((maps[OUTSIDE][contact] > 0).mean())
            says += f"; outside the table of k, D and H_V on {part:.1%} of the contact"
        anchor, axes, places = f"map-{len(drawn)}", ("x (mm)", "y (mm)"), (x[::stride], y[::stride])
        some = values[::stride, ::stride]
        drawn.append(HeatMap(anchor, title, says, *axes, unit, places, some, tint, True, limits))
    along = [
        Curve("pressure (bar), mean of all rows", x, maps[PRESSURE].mean(axis=0) / BAR),
        Curve("friction stress (bar)", x, maps[SHEAR].mean(axis=0) / BAR, 1),
    ]
    says = "Means over y, gaps between blocks included"
    drawn.append(Chart("along", "From trailing to leading edge", says, "x (mm)", "bar", along))
    return drawn


def _lines(folder: Path) -> list[HeatMap | Chart]:
    table = read_table(folder / "line.csv")
    pressure = {"pressure": table["pressure_Pa"] / BAR}
    drawn: list[HeatMap | Chart] = [
        _chart("pressure", "Contact pressure", "bar", MM * table["x_m"], pressure)
    ]
    for anchor, title, label, column in CHARTS:
        names = {name: column.format(key) for name, key in ALONG.items()}
        curves = {name: table[key] for name, key in names.items() if key in table}
        if anchor == "mu":
            curves = {name: np.where(mu > 0.0, mu, np.nan) for name, mu in curves.items()}
        if curves:
            drawn.append(_chart(anchor, title, label, MM * table["x_m"], curves))
    return drawn


def _chart(anchor: str, title: str, label: str, x: Array, columns: Mapping[str, Array]) -> Chart:
    says = "; ".join(
        f"{name} at most {np.nanmax(y):.4g} at {x[int(np.nanargmax(y))]:.4g} mm"
        for name, y in columns.items()
    )
    curves = [Curve(name, x, y, look) for look, (name, y) in enumerate(columns.items())]
    wide_apart = "y" if anchor in ("flux", "mu") else ""
    below = "x (mm), the tyre moves to the right"
    return Chart(anchor, title, says, below, label, curves, logarithmic=wide_apart)


def _command(case: Mapping[str, Any]) -> str:
    """The command of a case, with its non-default options."""
    image = case.get("image")
    words = ["iceslide footprint" + (f" {shlex.quote(str(image))}" if image else "")]
    usual = FootprintCase.model_fields
    for key, value in case.items():
        if key == "image" or value is None or (key in usual and value == usual[key].default):
            continue
        text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
        option = f"    --{key.replace('_', '-')}"
        words.append(option if value is True else f"{option} {shlex.quote(text)}")
    return " \\\n".join(words)
