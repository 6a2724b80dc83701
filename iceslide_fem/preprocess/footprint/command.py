"""What `iceslide footprint` does: read, compute, write; and its figures on the screen."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.preprocess.footprint.blocks import (
    TreadRubber,
    representative,
    scene_text,
    tread_blocks,
)
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.figures import draw_comparison, draw_maps
from iceslide_fem.preprocess.footprint.line_output import draw_line, line_columns, line_text
from iceslide_fem.preprocess.footprint.map_file import Maps, write_maps
from iceslide_fem.preprocess.footprint.outlines import outline_text
from iceslide_fem.preprocess.footprint.reading import ReadFootprint, read_footprint
from iceslide_fem.preprocess.footprint.survey import MODELS, Survey, check_friction, summary, survey
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.folders import claimed, clear_results, other_case
from iceslide_fem.runtime.progress import LongTask
from iceslide_fem.scene.fingerprint import versions
from iceslide_fem.scene.materials import BAR, ZERO_CELSIUS


def run(values: Mapping[str, Any], out: Path, force: bool = False) -> dict[str, Any]:
    """Survey the footprint that `values` describe (see `FootprintCase`) and write it to `out`.

    Writes summary.json, footprint.vti, pressure.png, temperature.png, wet_dry.png, mu.png,
    thesis.png, comparison.png and scenes/block_*, of a line summary.json, line.csv and
    line.png; returns the summary. The same footprint's
    earlier results go, with `force` any other results, too. Raises SceneError, before anything is
    written, if the input is wrong or `out` is not to be written to, and OutputError if something
    cannot be written.
    """
    begun = time.perf_counter()
    case = FootprintCase.of(values)
    here = case.model_dump(mode="json")
    with claimed(out, partial(other_case, "summary.json", here), force, case.files):
        return _run(case, out, begun)


def _run(case: FootprintCase, out: Path, begun: float) -> dict[str, Any]:
    read = read_footprint(case)
    scenes = _scenes(case, read)
    with LongTask(1.0) as shown:
        result = survey(
            case, read, lambda share: shown.show(share, f"film below {share:.0%} of the pixels")
        )
    check_friction(result)
    if case.one_line:
        _write_line(result, out)
    else:
        _write_maps(result, out, bool(scenes))
    for name, text in scenes.items():
        replace_file(out / "scenes" / name, text)
    figures = summary(result)
    figures |= {"wall_s": time.perf_counter() - begun, "versions": versions()}
    replace_file(out / "summary.json", json.dumps(figures, indent=2) + "\n")
    return figures


def _write_maps(result: Survey, out: Path, scenes: bool) -> None:
    with writing(out):
        clear_results(out)
        write_maps(out / "footprint.vti", all_maps(result))
        draw_maps(result, out)
        draw_comparison(result, out)
        if scenes:
            (out / "scenes").mkdir(exist_ok=True)


def _write_line(result: Survey, out: Path) -> None:
    columns, case = line_columns(result), result.case
    celsius = case.temperature - ZERO_CELSIUS
    row = "" if case.row is None else f", row {case.row}"
    title = (
        f"{case.source.name}{row}: {case.speed:g} m/s, slip {case.slip:g} "
        f"((3.3): {case.thesis_slip:g}), ice at {celsius:.3g} °C"
    )
    with writing(out):
        clear_results(out)
        draw_line(columns, title, out / "line.png")
    replace_file(out / "line.csv", line_text(columns))


def all_maps(result: Survey) -> Maps:
    """All maps of a survey."""
    footprint, film = result.read.pressure_map, result.film
    maps: dict[str, NDArray[Any]] = {
        "pressure (Pa)": footprint.pressure,
        "contact": footprint.contact.astype(np.uint8),
        "surface temperature (degC)": film.temperature - ZERO_CELSIUS,
        "film height (m)": film.height,
        "squeezed-out height (m)": film.squeezed,
        "shear stress (Pa)": film.shear,
        "mu": film.friction(footprint),
        "melting": film.melting.astype(np.uint8),
        "saturated": film.saturated.astype(np.uint8),
        "state (0 none, 1 dry, 2 mixed, 3 wet)": result.state,
        "rise by (3.3) (K)": result.thesis.rise,
        "mu by (4.7) to (4.9), (3.3)": result.thesis.mu,
        "rise by the moving source (K)": result.moving.rise,
        "mu by (4.7) to (4.9), moving source": result.moving.mu,
    }
    if result.read.distance is not None:
        maps["distance to the colour bar"] = result.read.distance
    if result.given is not None:
        maps["rise as given (K)"] = result.given.rise
        maps["mu by (4.7) to (4.9), as given"] = result.given.mu
    return Maps(maps, (footprint.dx, footprint.dy))


def lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The main figures as names and readable values."""
    footprint, film = figures["footprint"], figures["film"]
    rows = [
        ("pixels", " x ".join(str(count) for count in footprint["pixels"])),
        (
            "pixel size",
            " x ".join(f"{1e3 * size:.3g}" for size in footprint["pixel_size_m"]) + " mm",
        ),
        ("contact area", f"{1e4 * footprint['contact_area_m2']:.4g} cm2"),
        ("net / gross", f"{footprint['net_to_gross']:.3f}"),
        ("mean pressure", f"{footprint['mean_pressure_Pa'] / BAR:.4g} bar"),
        ("largest pressure", f"{footprint['max_pressure_Pa'] / BAR:.4g} bar"),
        ("load", f"{footprint['load_N']:.5g} N (pressures times {footprint['load_factor']:.4g})"),
        *(
            [("high pressure is read where", f"it is {figures['colours']['high_where']}")]
            if "high_where" in figures.get("colours", {})
            else []
        ),
        *(
            [("distance to the colour bar", f"median {colours['median_distance']:.3f}")]
            if (colours := figures.get("colours"))
            else []
        ),
        ("mean mu, film law", f"{film['mu_mean']:.4f}"),
        ("leading, trailing edge, film law", _edges(film)),
        ("melting, saturated", f"{film['melting_share']:.1%}, {film['saturated_share']:.1%}"),
        (
            "outside the table of k, D, H_V",
            f"{film['outside_table_share']:.1%} of the contact area",
        ),
    ]
    for key, name in MODELS.items():
        if key not in figures:
            continue
        model = figures[key]
        rows.append((f"peak rise, {name}", f"{model['peak_rise_K']:.4g} K"))
        rows.append((f"leading, trailing edge, {name}", _edges(model)))
        rows.append(
            (f"mu, {name}", f"{model['mu_map_mean']:.4g}, balance {model['mu_balance']:.4g}")
        )
    return [*rows, ("seconds", f"{figures['wall_s']:.1f}")]


def _edges(figures: Mapping[str, Any]) -> str:
    """Temperatures where the ice comes in and leaves, 3.2.2."""
    leading, trailing = (figures[f"{edge}_edge_temperature_C"] for edge in ("leading", "trailing"))
    return f"{leading:.2f}, {trailing:.2f} degC"


def _scenes(case: FootprintCase, read: ReadFootprint) -> dict[str, str]:
    """File names and texts of the scene of every representative block, and of its outline."""
    if not case.scenes:
        return {}
    chosen = representative(tread_blocks(read.pressure_map), case.scenes)
    rubber = TreadRubber(case.compound, case.contact, case.tread_height)
    pixel, ride = max(read.pressure_map.dx, read.pressure_map.dy), case.ride
    texts = {}
    for number, (block, share) in enumerate(chosen, start=1):
        name = f"block_{number:02d}"
        texts[f"{name}.toml"] = scene_text(name, block, share, ride, rubber)
        if block.outline:
            texts[f"{name}.csv"] = outline_text(block.outline, pixel)
    return texts
