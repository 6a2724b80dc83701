"""Charts of a survey: the map, its heights and spectrum, contact patches, k, D and H_V."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.postprocess.report.page import Chart, Curve, HeatMap
from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.preprocess.roughness.survey import Survey
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from iceslide_fem.surfaces.surface import spectrum, spectrum_fit

READ = "compound B, published (k at 5 bar: 0.405 is a reading of 0.105)"
# Of contact.csv: title, label with unit, factor.
PARAMETERS = (
    ("k", "Relative contact area", "k (1)", 1.0),
    ("D", "Diameter of patches", "D (µm)", 1e6),
    ("H_V", "Free height", "H_V (µm)", 1e6),
)


def charts(
    case: RoughnessCase, results: Sequence[Survey]
) -> Mapping[str, Sequence[Chart | HeatMap]]:
    """Charts by the names of pictures; patches are those of the last of several ages."""
    return {
        "map": _map(results[-1]),
        "contact": _contact(results[-1]),
        "parameters": [_parameter(results, *each) for each in PARAMETERS],
        "spectrum": [_spectrum(results[-1])],
    }


def _map(result: Survey) -> list[Chart | HeatMap]:
    heights = 1e6 * result.surface.heights
    limit, mean = float(np.percentile(np.abs(heights), 99.5)), result.statistics[0]
    said = (
        f"rms height {1e6 * mean.rms_height:.3g} µm, rms slope {mean.rms_slope:.3g}, skewness "
        f"{mean.skewness:.3g}"
    )
    density, edges = np.histogram(heights, bins=80, density=True)
    return [
        HeatMap("map", "The surface as it is pressed, heights towards the ice", said, "x (mm)",
                "y (mm)", "µm", _places(result), heights, "BrBG_r", True, (-limit, limit)),
        Chart("heights", "Distribution of heights", said, "height (µm)",
              "fraction of the area per µm", [Curve("area", _middle(edges), density)]),
    ]  # fmt: skip


def _contact(result: Survey) -> list[HeatMap]:
    highest = 1e6 * max(float(contact.gap.max()) for contact in result.shown.values())
    aged = "" if result.age is None else f", {1e3 * result.age:g} ms after loading"
    drawn = []
    for number, contact in result.shown.items():
        k, D = result.found[0, number][:2]
        gap = np.where(contact.pressure > 0.0, np.nan, 1e6 * contact.gap)
        title = f"Gap at {result.case.pressures[number] / BAR:.3g} bar{aged}"
        said = f"Grey is contact: k {k:.2f}, D {1e6 * D:.0f} µm"
        drawn.append(
            HeatMap(f"gap-{number}", title, said, "x (mm)", "y (mm)", "µm", _places(result), gap,
                    "Blues", True, (0.0, highest))
        )  # fmt: skip
    return drawn


def _parameter(
    results: Sequence[Survey], name: str, title: str, label: str, factor: float
) -> Chart:
    """One of k, D and H_V over pressure, with deviations between realisations."""
    p, curves = np.array(results[0].case.pressures) / BAR, []
    for look, result in enumerate(results):
        values, spread = (factor * getattr(each, name) for each in (result.mean, result.deviation))
        curves.append(Curve(_name(result), p, values, look))
        if len(result.found) > 1:
            lower = np.maximum(values - spread, 1e-3 * values)
            for mark, end in (("-", lower), ("+", values + spread)):
                curves.append(Curve(f"{mark} one standard deviation", p, end, look + 12))
    printed = CONTACT_TABLES["B"]
    bars, published = np.array(printed.pressure) / BAR, factor * getattr(printed, name).arrays[1]
    curves.append(Curve(READ, bars, published, 4, True))
    first = results[-1].mean
    low, high = (factor * float(getattr(first, name)[end]) for end in (0, -1))
    said = f"From {low:.3g} at {p[0]:.3g} bar to {high:.3g} at {p[-1]:.3g} bar"
    return Chart(name, title, said, "pressure (bar)", label, curves, logarithmic="xy")


def _name(result: Survey) -> str:
    several = len(result.found)
    if result.age is not None:
        return f"{1e3 * result.age:g} ms after loading"
    return f"mean of {several} realisations" if several > 1 else "this surface"


def _spectrum(result: Survey) -> Chart:
    found = spectrum(result.surface)
    shortest = result.cut_off or 2.0 * result.surface.pixel
    fit = spectrum_fit(found, shortest)
    wave = 2e6 * np.pi / found.q
    there = found.density > 1e-9 * found.density.max()
    curves = [Curve("mean over directions", wave[there], found.density[there])]
    said = f"The shortest wave is {1e6 * shortest:.3g} µm"
    if fit is not None:
        inside = wave >= 1e6 * shortest
        knee = np.maximum(1.0, 1e6 * fit.rolloff / wave[inside])
        line = knee ** (-2.0 * (1.0 + fit.hurst))
        use = found.density[inside] > 0.0
        level = np.exp(np.mean(np.log(found.density[inside][use] / line[use])))
        name = f"fit: Hurst {fit.hurst:.2f}, roll-off {1e6 * fit.rolloff:.3g} µm"
        curves.append(Curve(name, wave[inside], level * line, 1))
    x, y = "wave length (µm)", "power spectrum of heights (m⁴)"
    return Chart("spectrum", "Spectrum", said, x, y, curves, logarithmic="xy")


def _places(result: Survey) -> tuple[ArrayLike, ArrayLike]:
    """Middles of the pixels (mm)."""
    rows, columns = result.surface.heights.shape
    pixel = 1e3 * result.surface.pixel
    return pixel * (np.arange(columns) + 0.5), pixel * (np.arange(rows) + 0.5)


def _middle(edges: Array) -> Array:
    return 0.5 * (edges[1:] + edges[:-1])
