"""The page of a footprint: what was read, its maps and lines, friction and edge temperatures."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

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
from iceslide_fem.scene.materials import BAR, ZERO_CELSIUS

ABOUT_ERROR = (
    "The film law was advanced with a relative error of {:g} of mu per pixel; the macroscopic "
    "model has no steps. Its d and t are tuned: docs/footprint.md says how far to believe it."
)
LEFT_OUT = (
    "The film law: the tread pattern stands still over the picture; heat does not spread sideways; "
    "k, D and H_V follow the local pressure. The macroscopic model: nothing melts, and the heat is "
    "that of static friction everywhere."
)
PIXELS = 260  # of a map along x at most: every n-th is drawn
MM = 1e3
TABLES = {"footprint": "The contact", "colours": "How the picture was read"}
MODELS = {
    "film": "film law",
    "thesis": "(3.3) as printed",
    "moving_source": "moving source",
    "given": "temperatures given",
}
# What the rows of the models are called, where the key does not say it.
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
    "outside_table_share": "outside the table of k, D, H_V",
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
    ("height_m", "nm", 1e9),
    ("_m", "mm", 1e3),
    ("share", "%", 100.0),
)
CONTACT, PRESSURE, SHEAR = "contact", "pressure (Pa)", "shear stress (Pa)"
# Cell data of footprint.vti: title, unit, factor, colours.
MAPS = {
    PRESSURE: ("Contact pressure", "bar", 1.0 / BAR, "viridis"),
    "mu": ("Friction coefficient, film law", "", 1.0, "magma"),
    "surface temperature (degC)": ("Temperature of the ice, film law", "°C", 1.0, "inferno"),
    "film height (m)": ("Height of the water film", "nm", 1e9, "YlGnBu"),
    "state (0 none, 1 dry, 2 mixed, 3 wet)": (
        "Dry (1), mixed (2), wet (3), film law",
        "",
        1.0,
        "cividis",
    ),
    "rise by (3.3) (K)": ("Temperature rise by (3.3)", "K", 1.0, "inferno"),
    "rise by the moving source (K)": ("Temperature rise, moving source", "K", 1.0, "inferno"),
    "mu by (4.7) to (4.9), moving source": (
        "mu by (4.7) to (4.9), moving source",
        "",
        1.0,
        "magma",
    ),
}


def page_of_footprint(folder: Path, summary: Mapping[str, Any]) -> Page:
    """The page of the footprint in `folder`. Raises SceneError if its files are damaged."""
    try:
        case, film = summary["case"], summary["film"]
        one_line = "line" in summary
        tables = [_table(summary[name], title) for name, title in TABLES.items() if name in summary]
        tables.append(_models(summary))
        charts = _lines(folder) if one_line else _maps(folder)
        name = Path(summary["source"]).stem
        warnings = [
            Text(f"{sentence[:1].upper()}{sentence[1:]}.", "warning")
            for sentence in summary.get("warnings", [])
        ]
        celsius = case["temperature"] - ZERO_CELSIUS
        return Page(
            title=f"{name}: {'line along a' if one_line else ''} footprint".replace(":  ", ": "),
            summary=f"A tyre at {case['speed']:g} m/s with slip {case['slip']:g} on ice at "
            f"{celsius:.4g} °C. Mean friction by the film law: {film['mu_mean']:.4f}. Ice comes in "
            "at the right, where the tyre moves to, and leaves at the left.",
            sections=[
                Section(
                    "results",
                    "Results",
                    [
                        *tables,
                        Text(ABOUT_ERROR.format(case["tolerance"])),
                    ],
                ),
                Section("warnings", "Warnings", warnings or [Text("There was no warning.")]),
                Section("curves", "Along the line" if one_line else "Maps", charts),
                Section(
                    "neglected",
                    "What the models leave out",
                    [Text(LEFT_OUT)],
                ),
                Section(
                    "again",
                    "Run it again",
                    [Text(_command(case), "code"), _case(case), versions_of({"": summary})],
                ),
            ],
        )
    except (AttributeError, KeyError, OSError, TypeError, ValueError) as error:
        raise SceneError(f"{folder} holds no whole footprint ({error})") from None


def _table(entries: Mapping[str, Any], title: str) -> Table:
    rows = []
    for key, value in entries.items():
        if isinstance(value, int | float) and not isinstance(value, bool):
            rows.append([Cell(_name(key)), Cell(_text(key, value), key, value)])
    return Table(title, ["", ""], rows)


def _models(summary: Mapping[str, Any]) -> Table:
    """The film law and the macroscopic models side by side."""
    models = {name: summary[key] for key, name in MODELS.items() if key in summary}
    rows = []
    for key in {key: None for model in models.values() for key in model}:
        values = [model.get(key) for model in models.values()]
        texts = ("" if value is None else _text(key, value) for value in values)
        cells = [Cell(text, key, value) for text, value in zip(texts, values, strict=True)]
        first = next(number for number, value in enumerate(values) if value is not None)
        rows.append(
            [
                Cell(_name(key)),
                *(cell if i == first else Cell(cell.text) for i, cell in enumerate(cells)),
            ]
        )
    return Table("Friction and heat, by model", ["", *models], rows)


def _name(key: str) -> str:
    if key in NAMES:
        return NAMES[key]
    suffix = next((end for end, _, _ in UNITS if key.endswith(end) and end.startswith("_")), "")
    return key.removesuffix(suffix).replace("_", " ")


def _text(key: str, value: float) -> str:
    for end, unit, factor in UNITS:
        if key.endswith(end):
            return f"{factor * value:.4g} {unit}"
    return f"{value:.4g}"


def _maps(folder: Path) -> list[HeatMap | Chart]:
    from iceslide_fem.preprocess.footprint.map_file import read_maps

    path = folder / "footprint.vti"
    if not path.is_file():
        raise SceneError(f"{folder} holds no whole footprint (no footprint.vti)")
    maps, pixel = read_maps(path, {*MAPS, CONTACT, PRESSURE, SHEAR})
    contact = maps[CONTACT] > 0
    rows, columns = contact.shape
    stride = -(-columns // PIXELS)
    x, y = (
        (np.arange(count) + 0.5) * MM * size
        for count, size in ((columns, pixel[0]), (rows, pixel[1]))
    )
    drawn: list[HeatMap | Chart] = []
    for name, (title, unit, factor, tint) in MAPS.items():
        values = np.where(contact, factor * maps[name], np.nan)
        says = (
            f"Between {np.nanmin(values):.4g} and {np.nanmax(values):.4g} {unit}, mean of the "
            f"pixels {np.nanmean(values):.4g} {unit}".replace(" ,", ",").strip()
        )
        some = values[::stride, ::stride]
        places = (x[::stride], y[::stride])
        drawn.append(
            HeatMap(
                f"map-{len(drawn)}",
                title,
                says,
                "x (mm)",
                "y (mm)",
                unit,
                places,
                some,
                tint,
                equal=True,
            )
        )
    along = [
        Curve("pressure (bar), mean of all rows", x, maps[PRESSURE].mean(axis=0) / BAR),
        Curve("friction stress (bar)", x, maps[SHEAR].mean(axis=0) / BAR, 1),
    ]
    says = "Means over y, gaps between blocks included"
    drawn.append(Chart("along", "From trailing to leading edge", says, "x (mm)", "bar", along))
    return drawn


def _lines(folder: Path) -> list[Chart | HeatMap]:
    table = read_table(folder / "line.csv")
    x = MM * table["x_m"]

    def chart(name: str, title: str, axis: str, columns: Mapping[str, Array]) -> Chart:
        curves = [
            Curve(each, x, values, look) for look, (each, values) in enumerate(columns.items())
        ]
        peaks = (
            f"{curve.name} at most {np.nanmax(curve.y):.4g} at "
            f"{x[int(np.nanargmax(curve.y))]:.4g} mm"
            for curve in curves
        )
        wide_apart = "y" if name in ("flux", "mu") else ""
        x_axis = "x (mm), the tyre moves to the right"
        says = "; ".join(peaks)
        return Chart(name, title, says, x_axis, axis, curves, logarithmic=wide_apart)

    known = {"(3.3)": "thesis", "moving source": "moving", "given": "given"}
    models = {name: key for name, key in known.items() if f"mu_{key}" in table}
    film = {"film law": table["temperature_film_C"]}
    return [
        chart("pressure", "Contact pressure", "bar", {"pressure": table["pressure_Pa"] / BAR}),
        chart(
            "flux",
            "Heat flux by (3.2)",
            "W/m²",
            {name: table[f"flux_{key}_W_m2"] for name, key in models.items()},
        ),
        chart(
            "rise",
            "Temperature rise",
            "K",
            {name: table[f"rise_{key}_K"] for name, key in models.items()},
        ),
        chart(
            "temperature",
            "Temperature of the ice's surface",
            "°C",
            {name: table[f"temperature_{key}_C"] for name, key in models.items()} | film,
        ),
        chart(
            "state",
            "Dry (1), mixed (2), wet (3)",
            "state",
            {name: table[f"state_{key}"] for name, key in models.items()}
            | {"film law": table["state_film"]},
        ),
        chart(
            "mu",
            "Friction coefficient",
            "mu (1)",
            {
                name: np.where(mu > 0.0, mu, np.nan)
                for name, mu in (
                    *((name, table[f"mu_{key}"]) for name, key in models.items()),
                    ("film law", table["mu_film"]),
                )
            },
        ),
    ]


def _command(case: Mapping[str, Any]) -> str:
    """The command line of a case: what is not as by default."""
    words = ["iceslide footprint"]
    if case.get("image"):
        words[0] += f" {shlex.quote(str(case['image']))}"
    usual = FootprintCase.model_fields
    for key, value in case.items():
        if key == "image" or value is None or (key in usual and value == usual[key].default):
            continue
        text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
        words.append(f"    --{key.replace('_', '-')} {shlex.quote(text)}")
    return " \\\n".join(words)


def _case(case: Mapping[str, Any]) -> Table:
    rows = [[Cell(key), Cell(str(value))] for key, value in case.items() if value is not None]
    return Table("All options, SI units", ["option", "value"], rows)
