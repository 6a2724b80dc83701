"""Pictures of a survey: maps in millimetres, a line, and mean friction compared with formulas."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure

from iceslide_fem.film.doubts import LARGEST_FRICTION
from iceslide_fem.postprocess.results.style import (
    BLACK,
    BLUE,
    GREEN,
    NO_CONTACT,
    ORANGE,
    PURPLE,
    RED,
)
from iceslide_fem.preprocess.footprint.macroscopic import (
    MIXED_FROM,
    WET_FROM,
    HeatModel,
    State,
    States,
)
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.survey import Survey
from iceslide_fem.reference import stopping_distance
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR

DPI = 130
MM, KMH = 1e3, 3.6
STATE_COLOURS = {State.DRY: ORANGE, State.MIXED: PURPLE, State.WET: BLUE}
# Names and colours of the curves of a line.
LINES = {
    "thesis": ("(3.3)", ORANGE),
    "moving": ("moving source", BLUE),
    "given": ("as given", GREEN),
    "film": ("film law", BLACK),
}
SLACK = 1e-9
# Margins and gaps of the panels, as fractions of the page and of a panel. Automatic layout takes as
# long as the drawing.
ONE_MAP = {"left": 0.085, "right": 1.0, "bottom": 0.09, "top": 0.94}
SIX_MAPS = {"left": 0.045, "right": 0.99, "bottom": 0.06, "top": 0.9, "wspace": 0.2, "hspace": 0.25}
ONE_CHART = {"left": 0.22, "right": 0.98, "bottom": 0.1, "top": 0.94}
TWO_CHARTS = {"left": 0.125, "right": 0.99, "bottom": 0.1, "top": 0.94, "wspace": 0.16}
HATCHED = 200  # largest number of pixels along a side of hatched places
ROBUST = 99.0  # percentage of pixels within the colour range of mu and of a rise


def draw_maps(result: Survey, directory: Path) -> None:
    """Write pressure.png, temperature.png, wet_dry.png, mu.png, and of its models thesis.png."""
    case, film, footprint = result.case, result.film, result.read.pressure_map
    coldest, melting = (T - ZERO_CELSIUS for T in (case.temperature, case.melting_temperature))
    mu = film.friction(footprint)
    how = f"{case.speed:g} m/s, slip {case.slip:g}, ice at {coldest:.3g} °C"
    maps: dict[str, tuple[Array, str, str, str, Normalize]] = {
        "pressure": (
            footprint.pressure / BAR,
            f"Contact pressure: mean {footprint.mean_pressure / BAR:.3g} bar, "
            f"load {footprint.load:.4g} N",
            "pressure (bar)",
            "viridis",
            Normalize(0.0, float(footprint.pressure.max()) / BAR),
        ),
        "temperature": (
            film.temperature - ZERO_CELSIUS,
            f"Temperature of the ice surface ({how})",
            "temperature (°C)",
            "inferno",
            Normalize(coldest, melting),
        ),
        "mu": (
            mu,
            f"Friction coefficient: mean {result.mu_mean:.3g} ({how})",
            r"$\mu$ (1)",
            "magma",
            _mu_scale(mu[footprint.contact]),
        ),
    }
    for name, quantity in maps.items():
        figure = Figure(figsize=(8.6, 6.4))
        panel = figure.subplots(gridspec_kw=ONE_MAP)
        _map(panel, footprint, *quantity)
        if name == "mu" and result.outside.any():
            _hatch(panel, footprint, result.outside)
        figure.savefig(directory / f"{name}.png", dpi=DPI)
    figure = Figure(figsize=(8.6, 6.4))
    panel = figure.subplots(gridspec_kw=ONE_MAP)
    _states(panel, footprint, result.state, f"State of the ice ({how})", melting)
    figure.savefig(directory / "wet_dry.png", dpi=DPI)
    if result.models:
        _draw_models(result, directory)


def _draw_models(result: Survey, directory: Path) -> None:
    """Write thesis.png: the macroscopic model with both sources of heat."""
    case, footprint = result.case, result.read.pressure_map
    coldest = case.temperature - ZERO_CELSIUS
    figure = Figure(figsize=(16.0, 8.6))
    figure.suptitle(
        f"Macroscopic model, ice at {coldest:.3g} °C: heat of friction by (3.3), with slip "
        f"{case.thesis_slip:g} and t = {case.thesis_time:g} s (above), and by a "
        f"moving source, with slip {case.slip:g} (below)"
    )
    above, below = figure.subplots(2, 3, gridspec_kw=SIX_MAPS)
    said = f"d = {MM * case.depth:g} mm"
    printed = f"(3.3) as printed, slip {case.thesis_slip:g}"
    _heat_model(above, footprint, result.models["thesis"], printed, said)
    moving = f"Moving source, slip {case.slip:g}"
    _heat_model(below, footprint, result.models["moving_source"], moving, said)
    figure.savefig(directory / "thesis.png", dpi=DPI)


def draw_comparison(result: Survey, directory: Path) -> None:
    """Write comparison.png: mu over the ice temperature with the formulas, and of models over d."""
    case, curves = result.case, result.curves
    figure = Figure(figsize=(13.0 if result.models else 7.5, 5.6))
    left, *more = figure.subplots(
        1,
        2 if result.models else 1,
        squeeze=False,
        gridspec_kw=TWO_CHARTS if result.models else ONE_CHART,
    )[0]
    celsius = curves.temperature - ZERO_CELSIUS
    aggregate = f"{case.aggregate:g} g/m² of aggregate" if case.aggregate else "no aggregate"
    left.plot(celsius, curves.film, "o-", color=BLUE, label="film law under every pixel")
    left.plot(celsius, curves.navin, "--", color=GREEN, label=f"Navin (1.2), {aggregate}")
    left.plot(celsius, curves.peng, "-.", color=RED, label="Peng (1.7), weights put right")
    left.plot(celsius, curves.hayhoe, ":", color=BLACK, label="Hayhoe and Shapley (1.3) to (1.5)")
    left.set(xlabel="temperature of the ice (°C)", ylabel=r"mean $\mu$ (1)")
    left.set_ylim(0.0, 1.25 * float(np.max([curves.film, curves.navin, curves.peng])))
    left.set_title(f"Mean friction of the footprint, sliding at {case.slip * case.speed:.3g} m/s")
    ticks = left.secondary_yaxis(-0.16, functions=(lambda mu: mu, lambda mu: mu))
    ticks.yaxis.set_major_formatter(
        lambda mu, _: f"{float(stopping_distance(case.speed, mu)):.2g}" if mu > 0.0 else ""
    )
    ticks.set_ylabel(f"stopping distance from {KMH * case.speed:.3g} km/h (m), (1.1)")
    for panel in more:
        _over_depth(panel, result)
    for panel in (left, *more):
        panel.legend(fontsize=8)
        panel.grid(alpha=0.25)
    figure.savefig(directory / "comparison.png", dpi=DPI)


def _over_depth(right: Axes, result: Survey) -> None:
    """mu of the macroscopic models over the depth d."""
    case, models = result.case, result.models
    depth = np.geomspace(1e-6, 100.0, 200)
    for model, colour, name in (
        (models["thesis"], ORANGE, f"(3.3), slip {case.thesis_slip:g}"),
        (models["moving_source"], BLUE, f"moving source, slip {case.slip:g}"),
    ):
        for mu, style, what in (
            (model.mu_mean, "-", "mean of (4.7) to (4.9)"),
            (model.balance.mu, "--", "balance (3.8)"),
        ):
            label = f"{name}: {what}"
            right.loglog(MM * depth, case.depth * mu / depth, style, color=colour, label=label)
    right.axvline(MM * case.depth, color="0.6", linewidth=1.0)
    right.axhline(result.mu_mean, color=BLACK, linestyle=":", label="film law")
    right.annotate(
        f"d = {MM * case.depth:g} mm", (MM * case.depth, 3.0), rotation=90,
        ha="right", color="0.4", textcoords="offset points", xytext=(-3, 0),
    )  # fmt: skip
    right.set(xlabel="depth of heat penetration d (mm)", ylabel=r"mean $\mu$ (1)", ylim=(1e-3, 1e5))
    right.set_title("Macroscopic model: friction is proportional to 1/d")


def draw_line(result: Survey, columns: Mapping[str, Array], directory: Path) -> None:
    """Write line.png, like figs. 6 and 7 of the thesis, from the `columns` of line.csv (nx,):
    pressure, temperature rise, temperature and friction.
    """
    case = result.case
    figure = Figure(figsize=(11.5, 7.5), layout="constrained")
    row = "" if case.row is None else f", row {case.row}"
    figure.suptitle(
        f"{case.source.name}{row}: {case.speed:g} m/s, slip {case.slip:g}"
        f"{f' ((3.3): {case.thesis_slip:g})' if result.models else ''}, "
        f"ice at {case.temperature - ZERO_CELSIUS:.3g} °C",
        fontsize=13,
    )
    panels = figure.subplots(2, 2, sharex=True)
    x = MM * columns["x_m"]
    pressure, rise, temperature, friction = panels.flat
    pressure.plot(x, columns["pressure_Pa"] / BAR, color=BLACK)
    pressure.set(title="Pressure", ylabel="p (bar)")
    for key, (name, colour) in LINES.items():
        for panel, column in (
            (rise, f"rise_{key}_K"),
            (temperature, f"temperature_{key}_C"),
            (friction, f"mu_{key}"),
        ):
            if column in columns:
                shown = columns[column]
                if panel is friction:
                    shown = np.where(shown > 0.0, shown, np.nan)
                panel.plot(x, shown, color=colour, label=name)
    for bound in (MIXED_FROM, WET_FROM):
        temperature.axhline(bound, color=RED, linewidth=0.8, linestyle=":")
    rise.set(title="Temperature rise (module 2)", ylabel="K")
    if not result.models:
        rise.plot(x, 1e9 * columns["film_height_m"], color=BLACK, label="film law")
        rise.set(title="Height of the water film", ylabel="h (nm)")
    temperature.set(title="Temperature; dotted: bounds of dry, mixed, wet", ylabel="°C")
    friction.set(title="Friction", ylabel=r"$\mu$ (1)", yscale="log")
    if not result.models and columns["mu_film"].max() > LARGEST_FRICTION:
        friction.set(title=f"Friction up to {LARGEST_FRICTION:g}", ylim=(None, LARGEST_FRICTION))
    for panel in panels[1]:
        panel.set_xlabel("x (mm), the tyre moves to the right")
    for panel in panels.flat:
        panel.grid(alpha=0.25)
    rise.legend(fontsize=8)
    friction.legend(fontsize=8)
    figure.savefig(directory / "line.png", dpi=DPI)


def _mu_scale(mu: Array) -> LogNorm:
    """Of all but a percent of `mu` at both ends, and up to `LARGEST_FRICTION`."""
    low, high = np.percentile(mu, (100.0 - ROBUST, ROBUST))
    high = min(high, LARGEST_FRICTION)
    return LogNorm(min(low, 0.5 * high), high)


def _hatch(panel: Axes, footprint: PressureMap, places: Mask) -> None:
    """Hatch `places`, which are outside the table of k, D and H_V."""
    every = tuple(slice(None, None, -(-count // HATCHED)) for count in places.shape)
    some = places[every]
    edges = (np.linspace(0.0, MM * size, 1 + count) for size, count in zip(
        (footprint.dy * places.shape[0], footprint.dx * places.shape[1]), some.shape, strict=True
    ))  # fmt: skip
    y, x = (np.repeat(edge, 2)[1:-1] for edge in edges)  # both sides of each pixel
    doubled = np.repeat(np.repeat(some, 2, axis=0), 2, axis=1)
    panel.contourf(x, y, doubled, levels=[0.5, 1.5], colors="none", hatches=["////"])
    said = "hatched: pressures outside the table of k, D and H_V"
    panel.annotate(said, (0.01, 0.01), xycoords="axes fraction", fontsize=8)


def _heat_model(
    panels: Any, footprint: PressureMap, model: HeatModel, name: str, depth: str
) -> None:
    """Rise, state and friction of a macroscopic model on three panels."""
    contact = footprint.contact
    scales = (Normalize(0.0, np.percentile(f[contact], ROBUST)) for f in (model.rise, model.mu))
    title = f"{name}: peak {model.rise[contact].max():.3g} K"
    _map(panels[0], footprint, model.rise, title, "temperature rise (K)", "inferno", next(scales))
    balance = rf"State; balance (3.8) gives a mean $\mu$ of {model.balance.mu:.3g}"
    _states(panels[1], footprint, model.state, balance)
    title = rf"$\mu$ by (4.7) to (4.9), {depth}: mean {model.mu_mean:.3g}"
    _map(panels[2], footprint, model.mu, title, r"$\mu$ (1)", "magma", next(scales))


def _map(
    panel: Axes,
    footprint: PressureMap,
    values: Array,
    title: str,
    label: str,
    colours: str,
    norm: Normalize,
) -> None:
    """A quantity (ny, nx) on the footprint; `label`: of its colour bar."""
    shown = np.where(footprint.contact, values, np.nan)
    _image(panel, footprint, shown, title, cmap=colours, norm=norm)
    low, high = np.ma.getdata(norm([np.nanmin(shown), np.nanmax(shown)]))
    below, beyond = low < -SLACK, high > 1.0 + SLACK
    extend = ("both" if below else "max") if beyond else ("min" if below else "neither")
    bar = panel.figure.colorbar(
        ScalarMappable(norm, colours), ax=panel, label=label, extend=extend, shrink=0.9, pad=0.02
    )
    if isinstance(norm, LogNorm):
        bar.ax.yaxis.set(major_formatter="{x:g}", minor_formatter="{x:g}")


def _states(
    panel: Axes, footprint: PressureMap, state: States, title: str, melting: float = 0.0
) -> None:
    """Dry, mixed, wet; `melting` (degC) is the temperature from which on ice is wet."""
    colours = ListedColormap(list(STATE_COLOURS.values()))
    edges = [each - 0.5 for each in (*STATE_COLOURS, State.WET + 1)]
    norm = BoundaryNorm(edges, len(STATE_COLOURS))
    shown = np.where(state == State.NO_CONTACT, np.nan, state)
    _image(panel, footprint, shown, title, cmap=colours, norm=norm)
    bar = panel.figure.colorbar(
        ScalarMappable(norm, colours), ax=panel, ticks=list(STATE_COLOURS), shrink=0.9, pad=0.02
    )
    names = {
        State.DRY: f"dry\n(< {melting + MIXED_FROM:g} °C)",
        State.MIXED: f"mixed\n(< {melting + WET_FROM:g} °C)",
        State.WET: f"wet\n(≥ {melting + WET_FROM:g} °C)",
    }
    contact = np.count_nonzero(state)
    bar.ax.set_yticklabels(
        [f"{name}\n{np.count_nonzero(state == each) / contact:.0%}" for each, name in names.items()]
    )


def _image(panel: Axes, footprint: PressureMap, values: Array, title: str, **options: Any) -> None:
    rows, columns = values.shape
    extent = (0.0, MM * footprint.dx * columns, 0.0, MM * footprint.dy * rows)
    panel.set_facecolor(NO_CONTACT)
    # Colours are found for the pixels shown alone: the same ones in a quarter of the time.
    options |= {"interpolation": "nearest", "interpolation_stage": "data"}
    panel.imshow(values, origin="lower", extent=extent, **options)
    panel.set(xlabel="x (mm), the tyre moves to the right", ylabel="y (mm)")
    panel.set_title(title, fontsize=11)
