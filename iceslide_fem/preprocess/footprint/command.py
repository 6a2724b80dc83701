"""Work of `iceslide footprint`: read, compute, write."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.figures import draw_comparison, draw_line, draw_maps
from iceslide_fem.preprocess.footprint.map_file import write_maps
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.summary import summary
from iceslide_fem.preprocess.footprint.survey import Survey, survey
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.folders import claimed, clear_results, other_case
from iceslide_fem.runtime.progress import LongTask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.fingerprint import versions

# Maps of the macroscopic models by their names in the summary: rise, and mu.
OF_MODELS = {
    "thesis": ("rise by (3.3) (K)", "mu by (4.7) to (4.9), (3.3)"),
    "moving_source": ("rise by the moving source (K)", "mu by (4.7) to (4.9), moving source"),
    "given": ("rise as given (K)", "mu by (4.7) to (4.9), as given"),
}


def run(values: Mapping[str, Any], out: Path, force: bool = False) -> tuple[Survey, dict[str, Any]]:
    """Survey the footprint that `values` describe (see `FootprintCase`) and write it to `out`.

    Writes summary.json, footprint.vti, pressure.png, temperature.png, wet_dry.png, mu.png,
    comparison.png, and with the thesis's balance thesis.png, of a line summary.json, line.csv and
    line.png; returns the survey and the content of summary.json. Earlier results of the same
    footprint are replaced, with `force` any results. Raises SceneError, before anything is written,
    if the input is invalid or `out` must not be used, and OutputError if a file cannot be written.
    """
    begun = time.perf_counter()
    case = FootprintCase.of(values)
    here = case.model_dump(mode="json")
    with claimed(out, partial(other_case, "summary.json", here), force, case.files):
        read = read_footprint(case)
        with LongTask(1.0) as shown:
            result = survey(
                case, read, lambda part: shown.show(part, f"film below {part:.0%} of the pixels")
            )
        with writing(out):
            clear_results(out)
            if case.one_line:
                draw_line(result, line_columns(result), out)
            else:
                pixel = read.pressure_map.dx, read.pressure_map.dy
                write_maps(out / "footprint.vti", all_maps(result), pixel)
                draw_maps(result, out)
                draw_comparison(result, out)
        if case.one_line:
            replace_file(out / "line.csv", _csv(line_columns(result)))
        figures = summary(result)
        figures |= {"wall_s": time.perf_counter() - begun, "versions": versions()}
        replace_file(out / "summary.json", json.dumps(figures, indent=2) + "\n")
        return result, figures


def all_maps(result: Survey) -> dict[str, NDArray[Any]]:
    """All maps of a survey by name, (ny, nx)."""
    footprint, film = result.read.pressure_map, result.film
    voids = "squeezed-out height (m)" if result.borne is None else "water height (m)"
    maps: dict[str, NDArray[Any]] = {
        "pressure (Pa)": footprint.pressure,
        "contact": footprint.contact.astype(np.uint8),
        "surface temperature (degC)": film.temperature - ZERO_CELSIUS,
        "film height (m)": film.height,
        voids: film.squeezed,
        "shear stress (Pa)": film.shear,
        "mu": film.friction(footprint),
        "melting": film.melting.astype(np.uint8),
        "saturated": film.saturated.astype(np.uint8),
        "state (0 none, 1 dry, 2 mixed, 3 wet)": result.state,
        "outside the table": result.outside.astype(np.uint8),
    }
    for name, model in result.models.items():
        rise, mu = OF_MODELS[name]
        maps |= {rise: model.rise, mu: model.mu}
    if result.borne is not None:
        maps["pressure of the water (Pa)"] = result.borne
    if result.read.distance is not None:
        maps["distance to the colour bar"] = result.read.distance
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


def _csv(columns: Mapping[str, Array]) -> str:
    rows = zip(*columns.values(), strict=True)
    texts = (",".join(f"{value:.9g}" for value in row) for row in rows)
    return "\n".join([",".join(columns), *texts]) + "\n"
