"""`iceslide footprint`: read, compute, write; and words about it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.charts import (
    CONTACT,
    MU,
    OUTSIDE,
    PRESSURE,
    SHEAR,
    STATE,
    charts_of_area,
    charts_of_line,
    map_name,
)
from iceslide_fem.preprocess.footprint.macroscopic import Edges
from iceslide_fem.preprocess.footprint.map_file import write_maps
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.survey import MODELS, Survey, summary, survey
from iceslide_fem.preprocess.work import Charts, Preprocessor, Words, csv_text
from iceslide_fem.runs.verdict import in_words
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR

VTI, LINE, COMPARISON = "footprint.vti", "line.csv", "comparison.csv"
ABOUT_ERROR = "The film law was advanced with a relative error of {:g} of mu per pixel."
ABOUT_MODELS = (
    'The macroscopic model has no steps. Its d and t are tuned: the page "Footprints" says '
    "how far to believe it. Nothing melts in it, and the heat is that of static friction."
)
LEFT_OUT = (
    "The film law: the tread pattern stands still over the picture; heat does not spread sideways; "
    "k, D and H_V follow the local pressure."
)


def compute(case: FootprintCase) -> Survey:
    """The survey of a case. Raises SceneError, SimulationStopped."""
    read = read_footprint(case)
    with LongTask(1.0) as shown:
        return survey(
            case, read, lambda part: shown.show(part, f"film below {part:.0%} of the pixels")
        )


def write(case: FootprintCase, found: Survey, out: Path) -> None:
    """Write footprint.vti and comparison.csv, of a line line.csv. Raises OSError, OutputError."""
    if case.one_line:
        replace_file(out / LINE, csv_text(line_columns(found)))
        return
    pixels = found.read.pressure_map
    maps = {map_name(column): values for column, values in all_maps(found).items()}
    write_maps(out / VTI, maps, (pixels.dx, pixels.dy))
    replace_file(out / COMPARISON, csv_text(comparison_columns(found)))


def charts(case: FootprintCase, found: Survey) -> Charts:
    """Charts by the names of pictures."""
    if case.one_line:
        return charts_of_line(line_columns(found))
    pixels = found.read.pressure_map
    return charts_of_area(all_maps(found), (pixels.dx, pixels.dy), comparison_columns(found))


def all_maps(result: Survey) -> dict[str, NDArray[Any]]:
    """All maps of a survey by column, (ny, nx)."""
    footprint, film = result.read.pressure_map, result.film
    voids = "squeezed_height_m" if result.borne is None else "water_height_m"
    maps: dict[str, NDArray[Any]] = {
        PRESSURE: footprint.pressure,
        CONTACT: footprint.contact.astype(np.uint8),
        "surface_temperature_C": film.temperature - ZERO_CELSIUS,
        "film_height_m": film.height,
        voids: film.squeezed,
        SHEAR: film.shear,
        MU: film.friction(footprint),
        "melting": film.melting.astype(np.uint8),
        "saturated": film.saturated.astype(np.uint8),
        STATE: result.state,
        OUTSIDE: result.outside.astype(np.uint8),
    }
    for key, model in result.models.items():
        name = key.removesuffix("_source")
        maps |= {f"rise_{name}_K": model.rise, f"mu_{name}": model.mu}
    if result.borne is not None:
        maps["water_pressure_Pa"] = result.borne
    if result.read.distance is not None:
        maps["distance_to_colours"] = result.read.distance
    return maps


def line_columns(result: Survey) -> dict[str, Array]:
    """Columns of line.csv, names with units -> (nx,): all three modules, and the film law."""
    footprint, film = result.read.pressure_map, result.film
    columns = {"x_m": result.read.left + footprint.x, "pressure_Pa": footprint.pressure[0]}
    for key, model in result.models.items():
        name = key.removesuffix("_source")
        columns |= {
            f"flux_{name}_W_m2": model.flux[0],
            f"rise_{name}_K": model.rise[0],
            f"temperature_{name}_C": model.temperature[0] - ZERO_CELSIUS,
            f"state_{name}": model.state[0].astype(float),
            f"mu_{name}": model.mu[0],
        }
    if result.borne is not None:
        columns |= {"water_height_m": film.squeezed[0], "water_pressure_Pa": result.borne[0]}
    return columns | {
        "temperature_film_C": film.temperature[0] - ZERO_CELSIUS,
        "film_height_m": film.height[0],
        "state_film": result.state[0].astype(float),
        "mu_film": film.friction(footprint)[0],
    }


def comparison_columns(result: Survey) -> dict[str, Array]:
    """Columns of comparison.csv, names with units -> (temperatures,)."""
    celsius, *mu = result.curves
    names = (f"mu_{name}" for name in result.curves._fields[1:])
    return {"temperature_C": celsius - ZERO_CELSIUS, **dict(zip(names, mu, strict=True))}


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of a footprint."""
    case, line = figures["case"], "line along a " * ("line" in figures)
    error = ABOUT_ERROR.format(case["tolerance"])
    mu = figures["film"]["mu_mean"]
    return Words(
        title=f"{Path(figures['source']).stem}: {line}footprint",
        summary=f"A tyre at {case['speed']:g} m/s with slip {case['slip']:g} on ice at "
        f"{case['temperature'] - ZERO_CELSIUS:.4g} °C. Mean friction by the film law: "
        f"{figures['film']['mu_mean']:.4f}. Ice comes in at the right, where the tyre moves "
        "to, and leaves at the left.",
        lines=_lines(figures),
        left_out=LEFT_OUT,
        remarks=[error, ABOUT_MODELS] if case["thesis_balance"] else [error],
        verdict=in_words("Mean mu", mu, case["tolerance"], "film, per pixel"),
    )


def _lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The main figures of a summary as names and readable values."""
    footprint, film, colours = figures["footprint"], figures["film"], figures.get("colours", {})
    pixel = " x ".join(f"{1e3 * size:.3g}" for size in footprint["pixel_size_m"])
    rows = [
        ("contact length", f"{1e3 * footprint['contact_length_m']:.4g} mm"),
        ("pixels", " x ".join(str(count) for count in footprint["pixels"])),
        ("pixel size", f"{pixel} mm"),
        ("contact area", f"{1e4 * footprint['contact_area_m2']:.4g} cm2"),
        ("net / gross", f"{footprint['net_to_gross']:.3f}"),
        ("mean pressure", f"{footprint['mean_pressure_Pa'] / BAR:.4g} bar"),
        ("largest pressure", f"{footprint['max_pressure_Pa'] / BAR:.4g} bar"),
        ("load", f"{footprint['load_N']:.5g} N (pressures times {footprint['load_factor']:.4g})"),
    ]
    if "high_where" in colours:
        rows.append(("high pressure is read where", f"it is {colours['high_where']}"))
    if colours:
        rows.append(("distance to the colour bar", f"median {colours['median_distance']:.3f}"))
    outside = (
        f"{film['outside_table_share']:.1%} of the contact area, "
        f"{film['outside_table_friction_share']:.1%} of the friction"
    )
    rows += [
        ("mean mu, film law", f"{film['mu_mean']:.4f}"),
        ("leading, trailing edge, film law", _both_edges(film)),
        ("melting, saturated", f"{film['melting_share']:.1%}, {film['saturated_share']:.1%}"),
        ("outside the table of k, D, H_V", outside),
    ]
    if "water_borne_share" in film:
        rows += [
            ("water in the voids, mean", f"{1e6 * film['mean_water_height_m']:.4g} um"),
            ("load borne by water", f"{film['water_borne_share']:.1%}"),
            ("lug that water flows out of", f"{1e3 * film['lug_m']:.4g} mm"),
        ]
    for key, name in MODELS.items():
        if model := figures.get(key):
            mu = f"{model['mu_map_mean']:.4g}, balance {model['mu_balance']:.4g}"
            rows += [
                (f"peak rise, {name}", f"{model['peak_rise_K']:.4g} K"),
                (f"leading, trailing edge, {name}", _both_edges(model)),
                (f"mu, {name}", mu),
            ]
    return [*rows, ("seconds", f"{figures['wall_s']:.1f}")]


def _both_edges(figures: Mapping[str, Any]) -> str:
    """Temperatures of the ice at the leading and trailing edge, 3.2.2."""
    leading, trailing = (figures[f"{edge}_edge_temperature_C"] for edge in Edges._fields)
    return f"{leading:.2f}, {trailing:.2f} degC"


FOOTPRINT = Preprocessor(
    "footprint", FootprintCase, compute, lambda _, found: summary(found), write, charts, words
)
