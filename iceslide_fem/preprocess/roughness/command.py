"""Work of `iceslide roughness`: read or generate, press, write; and printed figures."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.preprocess.roughness.figures import draw
from iceslide_fem.preprocess.roughness.survey import Survey, summary, surveys, table
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.folders import claimed, clear_results, other_case
from iceslide_fem.scene.materials import BAR


def run(
    values: Mapping[str, Any], out: Path, force: bool = False
) -> tuple[list[Survey], dict[str, Any]]:
    """Press the surface that `values` describe (see `RoughnessCase`) and write to `out`.

    Writes contact.csv (of several ages contact_5ms.csv and so on), surface.json, map.png,
    contact.png, parameters.png and spectrum.png; returns the surveys, one for each age, and the
    content of surface.json. Earlier results of the same surface are replaced, with `force` any
    results. Raises SceneError, before anything is written, if the input is invalid or `out` must
    not be used, and OutputError if a file cannot be written.
    """
    begun = time.perf_counter()
    case = RoughnessCase.of(values)
    here = case.model_dump(mode="json")
    with claimed(out, partial(other_case, "surface.json", here), force, case.files):
        results = surveys(case)
        figures = summary(results[-1])
        with writing(out):
            clear_results(out)
            draw(results, out)
        for result in results:
            replace_file(out / table_name(result, results), table(result))
        figures["wall_s"] = time.perf_counter() - begun
        replace_file(out / "surface.json", json.dumps(figures, indent=2) + "\n")
        return results, figures


def table_name(result: Survey, results: Sequence[Survey]) -> str:
    """File name of a result's table, with its age if there are several."""
    if result.age is None or len(results) == 1:
        return "contact.csv"
    return f"contact_{1e3 * result.age:g}ms.csv"


def lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The main figures of the surface as names and readable values."""
    cut, fit, measured = figures["cut_offs"], figures["spectrum_fit"], figures["measured"]
    wave = cut["shortest_wave_m"]
    grid = "{} x {} pixels of {:.4g} um"
    sides = " x ".join(f"{1e3 * side:.3g}" for side in cut["size_m"])
    pressed = f"{grid.format(*figures['pixels'], 1e6 * cut['pixel_m'])}, {sides} mm"
    height, slope = f"{1e6 * figures['rms_height_m']:.3g} um", f"{figures['rms_slope']:.3g}"
    maps = [("map", pressed)]
    if measured is not None:
        map_ = grid.format(*measured["pixels"], 1e6 * measured["pixel_m"])
        maps = [("map", map_), ("map, as pressed", f"{pressed}, continued by its mirror images")]
        if wave is not None:
            height += f"; {1e6 * measured['rms_height']:.3g} um with all waves of the map"
            slope += f"; {measured['rms_slope']:.3g} with all waves of the map"
    spectrum = "too few waves for a fit"
    if fit is not None:
        spectrum = f"Hurst {fit['hurst']:.2f}, roll-off {1e6 * fit['rolloff_m']:.3g} um"
    rubber = f"{figures['rubber']}, E* = {figures['modulus_Pa'] / 1e6:.4g} MPa"
    relaxing = []
    if figures["ages_s"]:
        rubber += ", instantaneous"
        relaxing = [("a_T", f"{figures['a_T']:.4g}")]
    solver = figures["solver"]
    return [
        ("rubber", rubber),
        *relaxing,
        *maps,
        ("realisations", str(figures["realisations"])),
        ("rms height", height),
        ("rms slope", slope),
        ("skewness", f"{figures['skewness']:.3g}"),
        ("spectrum", spectrum),
        ("shortest wave", "as the pixels show" if wave is None else f"{1e6 * wave:.4g} um"),
        ("definition of k and D", figures["definition"]),
        ("iterations", str(solver["iterations"])),
        ("seconds", f"{figures['wall_s']:.1f}"),
    ]


def rows(result: Survey) -> list[tuple[str, ...]]:
    """Pressure (bar), k, D (um), H_V (um) with deviations, and k/D (1/mm), as text."""
    mean, deviation = result.mean, result.deviation
    several = len(result.found) > 1

    def text(value: float, spread: float) -> str:
        return f"{value:.3g} ± {spread:.1g}" if several else f"{value:.3g}"

    return [
        (
            f"{p / BAR:.3g}",
            text(mean.k[i], deviation.k[i]),
            text(1e6 * mean.D[i], 1e6 * deviation.D[i]),
            text(1e6 * mean.H_V[i], 1e6 * deviation.H_V[i]),
            f"{1e-3 * mean.k[i] / mean.D[i]:.3g}",
        )
        for i, p in enumerate(result.case.pressures)
    ]
