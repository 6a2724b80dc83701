"""Pictures of a survey: the map, its spectrum, contact patches, and k, D, H_V over pressure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from iceslide_fem.preprocess.roughness.surface import spectrum, spectrum_fit
from iceslide_fem.preprocess.roughness.survey import Survey
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES

DPI = 120
PRINTED = "compound B, published"
READ = "k at 5 bar: 0.405 is a reading of 0.105"


def draw(results: Sequence[Survey], out: Path) -> None:
    """Write map.png, contact.png, parameters.png and spectrum.png to `out`.

    results: of one surface, one for each age; patches are shown of the last one.
    """
    result = results[-1]
    _map(result).savefig(out / "map.png", dpi=DPI)
    _contact(result).savefig(out / "contact.png", dpi=DPI)
    _parameters(results).savefig(out / "parameters.png", dpi=DPI)
    _spectrum(result).savefig(out / "spectrum.png", dpi=DPI)


def _map(result: Survey) -> Figure:
    surface = result.surface
    heights = 1e6 * surface.heights
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    limit = float(np.percentile(np.abs(heights), 99.5))
    image = left.imshow(
        heights, extent=_extent(result), origin="lower", cmap="BrBG_r", vmin=-limit, vmax=limit
    )
    figure.colorbar(image, ax=left, extend="both", label="height towards the ice (µm)")
    left.set(xlabel="x (mm)", ylabel="y (mm)", title="the surface as it is pressed")
    right.hist(heights.ravel(), bins=80, density=True, orientation="horizontal", color="C5")
    mean = result.statistics[0]
    right.set(
        xlabel="fraction of the area per µm",
        ylabel="height (µm)",
        title=f"rms {1e6 * mean.rms_height:.2f} µm,\nslope {mean.rms_slope:.2f}, "
        f"skewness {mean.skewness:.2f}",
    )
    return figure


def _contact(result: Survey) -> Figure:
    figure = Figure(figsize=(11, 4), layout="constrained")
    highest = 1e6 * max(float(contact.gap.max()) for contact in result.shown.values())
    panels = figure.subplots(1, len(result.shown), squeeze=False)[0]
    for axes, (number, contact) in zip(panels, result.shown.items(), strict=True):
        found = result.found[0, number]
        gap = np.where(contact.pressure > 0.0, np.nan, 1e6 * contact.gap)
        axes.set_facecolor("black")
        image = axes.imshow(
            gap, extent=_extent(result), origin="lower", cmap="Blues", vmin=0, vmax=highest
        )
        axes.set(
            xlabel="x (mm)",
            title=f"{result.case.pressures[number] / BAR:.3g} bar: k {found[0]:.2f}, "
            f"D {1e6 * found[1]:.0f} µm",
        )
    panels[0].set_ylabel("y (mm)")
    figure.colorbar(image, ax=panels, label="gap (µm); contact is black")
    if result.age is not None:
        figure.suptitle(f"{1e3 * result.age:g} ms after loading")
    return figure


def _parameters(results: Sequence[Survey]) -> Figure:
    p = np.array(results[0].case.pressures) / BAR
    printed = CONTACT_TABLES["B"]
    bars = np.array(printed.pressure) / BAR
    figure = Figure(figsize=(11, 4), layout="constrained")
    panels = figure.subplots(1, 3)
    for number, scale, points, label in (
        (0, 1.0, printed.k, "k, relative contact area"),
        (1, 1e6, printed.D, "D, patch diameter (µm)"),
        (2, 1e6, printed.H_V, "H_V, free height (µm)"),
    ):
        axes = panels[number]
        for colour, result in enumerate(results):
            values, spread = scale * result.mean[number], scale * result.deviation[number]
            axes.plot(p, values, f"C{colour}.-", label=_name(result))
            if len(result.found) > 1:
                low = np.maximum(values - spread, 1e-3 * values)
                axes.fill_between(p, low, values + spread, alpha=0.3, color=f"C{colour}")
        published = scale * np.array(points)
        sure = 1 if number == 0 else len(bars)
        axes.plot(bars[:sure], published[:sure], "ks", label=PRINTED)
        axes.plot(bars[sure:], published[sure:], "s", mfc="none", mec="k", label=READ)
        axes.set(xscale="log", yscale="log", xlabel="pressure (bar)", title=label)
        axes.grid(True, which="both", alpha=0.2)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(1.5, 0.7)))
    # The range of H_V stays readable where contact is complete.
    lowest = min(float(result.mean.H_V.min()) for result in results)
    panels[-1].set_ylim(bottom=max(1e-3, 0.5 * 1e6 * lowest))
    panels[0].legend(fontsize=8)
    return figure


def _name(result: Survey) -> str:
    several = len(result.found)
    spread = " ± std" if several > 1 else ""
    if result.age is not None:
        return f"{1e3 * result.age:g} ms after loading{spread}"
    return f"mean{spread} of {several} realisations" if several > 1 else "this surface"


def _spectrum(result: Survey) -> Figure:
    found = spectrum(result.surface)
    shortest = result.cut_off or 2.0 * result.surface.pixel
    fit = spectrum_fit(found, shortest)
    figure = Figure(figsize=(6.5, 4.5), layout="constrained")
    axes = figure.subplots()
    wave = 2e6 * np.pi / found.q
    there = found.density > 1e-9 * found.density.max()
    axes.loglog(wave[there], found.density[there], "C0.-", label="mean over directions")
    label = f"shortest wave {1e6 * shortest:.3g} µm"
    axes.axvline(1e6 * shortest, color="C3", ls="--", label=label)
    axes.axvline(2e6 * result.surface.pixel, color="0.5", ls=":", label="two pixels")
    if fit is not None:
        inside = wave >= 1e6 * shortest
        knee = np.maximum(1.0, 1e6 * fit.rolloff / wave[inside])
        line = knee ** (-2.0 * (1.0 + fit.hurst))
        use = found.density[inside] > 0.0
        level = np.exp(np.mean(np.log(found.density[inside][use] / line[use])))
        label = f"fit: Hurst {fit.hurst:.2f}, roll-off {1e6 * fit.rolloff:.3g} µm"
        axes.loglog(wave[inside], level * line, "k-", lw=1, label=label)
    axes.invert_xaxis()
    axes.set(xlabel="wave length (µm)", ylabel="power spectrum of heights (m⁴)")
    axes.legend(fontsize=8)
    axes.grid(True, which="both", alpha=0.2)
    return figure


def _extent(result: Survey) -> tuple[float, float, float, float]:
    width, height = result.surface.size
    return 0.0, 1e3 * width, 0.0, 1e3 * height
