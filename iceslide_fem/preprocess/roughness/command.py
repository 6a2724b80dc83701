"""`iceslide roughness`: read or generate, press, write; and words about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.report.page import Cell, Table
from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.preprocess.roughness.charts import charts
from iceslide_fem.preprocess.roughness.survey import Survey, summary, surveys, table
from iceslide_fem.preprocess.work import Preprocessor, Words
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.scene.materials import BAR

HEAD = ("p (bar)", "k", "D (um)", "H_V (um)", "k/D (1/mm)")
ABOUT_WAVES = (
    "k and D hold for the shortest wave that is kept; with shorter ones both are smaller, and mean "
    'friction changes much less (page "Contact parameters from a rough surface").'
)
LEFT_OUT = (
    "The ice is smooth and rigid, and rubber and ice do not adhere. The rubber is a half-space of "
    "linear elasticity, or linear viscoelasticity with --age."
)


def write(case: RoughnessCase, results: Sequence[Survey], out: Path) -> None:
    """Write contact.csv, or of several ages contact_5ms.csv and so on."""
    for result in results:
        replace_file(out / table_name(result, results), table(result))


def figures_of(case: RoughnessCase, results: Sequence[Survey]) -> dict[str, Any]:
    """All data of the surface, and the rows that terminal and page show."""
    shown = {_title(result): _rows(result) for result in results}
    return summary(results[-1]) | {"shown": shown}


def table_name(result: Survey, results: Sequence[Survey]) -> str:
    """File name of a result's table, with its age if there are several."""
    if result.age is None or len(results) == 1:
        return "contact.csv"
    return f"contact_{1e3 * result.age:g}ms.csv"


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of a surface."""
    tables = [
        Table(title, HEAD, [[Cell(text) for text in row] for row in rows])
        for title, rows in figures["shown"].items()
    ]
    return Words(
        title=f"{Path(figures['case']['surface']).stem}: contact of a rough surface",
        summary=f"k, D and H_V of rubber with E* = {figures['modulus_Pa'] / 1e6:.4g} MPa on smooth "
        f"ice, by {figures['realisations']} pressed surfaces.",
        lines=_lines(figures),
        left_out=LEFT_OUT,
        tables=tables,
        remarks=[ABOUT_WAVES],
    )


def _title(result: Survey) -> str:
    if result.age is None:
        return "Contact over pressure"
    return f"{1e3 * result.age:g} ms after loading"


def _lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
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


def _rows(result: Survey) -> list[tuple[str, ...]]:
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


ROUGHNESS = Preprocessor(
    "roughness", RoughnessCase, surveys, figures_of, write, charts, words, summary="surface.json"
)
