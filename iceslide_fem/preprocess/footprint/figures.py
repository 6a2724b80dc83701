"""Pictures of a survey: maps in millimetres, and the comparison with formulas of chapter 2."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from iceslide_fem.postprocess.results.style import (
    BLACK,
    BLUE,
    GREEN,
    NO_CONTACT,
    ORANGE,
    PURPLE,
    RED,
)
from iceslide_fem.preprocess.footprint.balance import MIXED_FROM, WET_FROM, State
from iceslide_fem.preprocess.footprint.empirical import stopping_distance
from iceslide_fem.preprocess.footprint.macroscopic import HeatModel
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.survey import Survey
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.materials import BAR, ZERO_CELSIUS

DPI = 130
MM, NM, KMH = 1e3, 1e9, 3.6
STATE_COLOURS = {State.DRY: ORANGE, State.MIXED: PURPLE, State.WET: BLUE}
SLACK = 1e-9
# Edges and gaps of the panels, as shares of the page and of a panel.
ONE_MAP = {"left": 0.085, "right": 1.0, "bottom": 0.09, "top": 0.94}
SIX_MAPS = {"left": 0.045, "right": 0.99, "bottom": 0.06, "top": 0.9, "wspace": 0.2, "hspace": 0.25}
TWO_CHARTS = {"left": 0.125, "right": 0.99, "bottom": 0.1, "top": 0.94, "wspace": 0.16}
ROBUST = 99.0  # per cent of the pixels that the colours of mu and of a rise span


class Map(NamedTuple):
    """A quantity on the footprint: values, title, label of the colour bar, colours and scale."""

    values: Array
    title: str
    label: str
    colours: str
    norm: Normalize


def draw_maps(result: Survey, directory: Path) -> list[Path]:
    """Write pressure.png, temperature.png, wet_dry.png, mu.png and thesis.png; their paths."""
    footprint, film = result.read.pressure_map, result.film
    contact = footprint.contact
    coldest = result.case.temperature - ZERO_CELSIUS
    melting = result.case.melting_temperature - ZERO_CELSIUS
    mu = film.friction(footprint)
    how = f"{result.case.speed:g} m/s, slip {result.case.slip:g}, ice at {coldest:.3g} °C"
    maps = {
        "pressure": Map(
            footprint.pressure / BAR,
            f"Contact pressure: mean {footprint.mean_pressure / BAR:.3g} bar, "
            f"load {footprint.load:.4g} N",
            "pressure (bar)",
            "viridis",
            Normalize(0.0, float(footprint.pressure.max()) / BAR),
        ),
        "temperature": Map(
            film.temperature - ZERO_CELSIUS,
            f"Temperature of the ice surface ({how})",
            "temperature (°C)",
            "inferno",
            Normalize(coldest, melting),
        ),
        "mu": Map(
            mu,
            f"Friction coefficient: mean {film.mean_friction(footprint):.3g} ({how})",
            r"$\mu$ (1)",
            "magma",
            LogNorm(*np.percentile(mu[contact], (100.0 - ROBUST, ROBUST))),
        ),
    }
    paths = []
    for name, quantity in maps.items():
        figure, (panel,) = _page(1, 1, (8.6, 6.4), **ONE_MAP)
        _map(panel, footprint, quantity, contact)
        paths.append(_save(figure, directory / f"{name}.png"))
    figure, (panel,) = _page(1, 1, (8.6, 6.4), **ONE_MAP)
    _states(panel, footprint, result.state, f"State of the ice ({how})", melting)
    paths.append(_save(figure, directory / "wet_dry.png"))
    figure, panels = _page(2, 3, (16.0, 8.6), **SIX_MAPS)
    figure.suptitle(
        f"Macroscopic model, ice at {coldest:.3g} °C: heat of friction by (3.3), with slip "
        f"{result.case.thesis_slip:g} and t = {result.case.thesis_time:g} s (above), and by a "
        f"moving source, with slip {result.case.slip:g} (below)"
    )
    _heat_model(panels[:3], result, result.thesis, "(3.3) as printed")
    _heat_model(panels[3:], result, result.moving, "Moving source")
    paths.append(_save(figure, directory / "thesis.png"))
    return paths


def draw_comparison(result: Survey, directory: Path) -> Path:
    """Write comparison.png: mu over the ice temperature beside the formulas, and over d."""
    figure, (left, right) = _page(1, 2, (13.0, 5.6), **TWO_CHARTS)
    curves = result.curves
    celsius = curves.temperature - ZERO_CELSIUS
    sliding = result.case.slip * result.case.speed
    spread = result.case.aggregate
    aggregate = f"{spread:g} g/m² of aggregate" if spread else "no aggregate"
    left.plot(celsius, curves.film, "o-", color=BLUE, label="film law under every pixel")
    left.plot(celsius, curves.navin, "--", color=GREEN, label=f"Navin (1.2), {aggregate}")
    left.plot(celsius, curves.peng, "-.", color=RED, label="Peng (1.7), weights put right")
    left.plot(celsius, curves.hayhoe, ":", color=BLACK, label="Hayhoe and Shapley (1.3) to (1.5)")
    left.set(xlabel="temperature of the ice (°C)", ylabel=r"mean $\mu$ (1)")
    left.set_ylim(0.0, 1.25 * float(np.max([curves.film, curves.navin, curves.peng])))
    left.set_title(f"Mean friction of the footprint, sliding at {sliding:.3g} m/s")
    ticks = left.secondary_yaxis(-0.16, functions=(lambda mu: mu, lambda mu: mu))
    speed = KMH * result.case.speed
    ticks.yaxis.set_major_formatter(
        lambda mu, _: f"{float(stopping_distance(speed, mu)):.2g}" if mu > 0.0 else ""
    )
    ticks.set_ylabel(f"stopping distance from {speed:.3g} km/h (m), (1.1)")
    for model, colour, name in (
        (result.thesis, ORANGE, f"(3.3), slip {result.thesis.sliding.slip:g}"),
        (result.moving, BLUE, f"moving source, slip {result.moving.sliding.slip:g}"),
    ):
        depth = np.geomspace(1e-6, 100.0, 200)
        mean = result.case.depth * float(model.mu[result.read.pressure_map.contact].mean())
        balance = result.case.depth * model.balance.mu
        right.loglog(
            MM * depth, mean / depth, color=colour, label=f"{name}: mean of (4.7) to (4.9)"
        )
        right.loglog(
            MM * depth, balance / depth, "--", color=colour, label=f"{name}: balance (3.8)"
        )
    right.axvline(MM * result.case.depth, color="0.6", linewidth=1.0)
    right.axhline(
        result.film.mean_friction(result.read.pressure_map),
        color=BLACK,
        linestyle=":",
        label="film law",
    )
    right.annotate(
        f"d = {MM * result.case.depth:g} mm", (MM * result.case.depth, 3.0), rotation=90,
        ha="right", color="0.4", textcoords="offset points", xytext=(-3, 0),
    )  # fmt: skip
    right.set(xlabel="depth of heat penetration d (mm)", ylabel=r"mean $\mu$ (1)", ylim=(1e-3, 1e5))
    right.set_title("Macroscopic model: friction is proportional to 1/d")
    for panel in (left, right):
        panel.legend(fontsize=8)
        panel.grid(alpha=0.25)
    return _save(figure, directory / "comparison.png")


def _heat_model(panels: list[Axes], result: Survey, model: HeatModel, name: str) -> None:
    footprint, contact = result.read.pressure_map, result.read.pressure_map.contact
    slip, depth = model.sliding.slip, MM * result.case.depth
    rise = Map(
        model.rise,
        f"{name}, slip {slip:g}: peak {model.rise[contact].max():.3g} K",
        "temperature rise (K)",
        "inferno",
        Normalize(0.0, float(np.percentile(model.rise[contact], ROBUST))),
    )
    mu = Map(
        model.mu,
        rf"$\mu$ by (4.7) to (4.9), d = {depth:g} mm: mean {model.mu[contact].mean():.3g}",
        r"$\mu$ (1)",
        "magma",
        Normalize(0.0, float(np.percentile(model.mu[contact], ROBUST))),
    )
    _map(panels[0], footprint, rise, contact)
    balance = rf"State; balance (3.8) gives a mean $\mu$ of {model.balance.mu:.3g}"
    _states(panels[1], footprint, model.state, balance)
    _map(panels[2], footprint, mu, contact)


def _page(
    rows: int, columns: int, size: tuple[float, float], **gaps: float
) -> tuple[Figure, list[Axes]]:
    """Panels with `gaps` of their own: to find them would take as long as all the drawing."""
    figure = Figure(figsize=size)
    return figure, list(figure.subplots(rows, columns, squeeze=False, gridspec_kw=gaps).flat)


def _map(panel: Axes, footprint: PressureMap, quantity: Map, contact: Mask) -> None:
    norm = quantity.norm
    shown = np.where(contact, quantity.values, np.nan)
    _image(panel, footprint, shown, cmap=quantity.colours, norm=norm)
    low, high = np.ma.getdata(norm([np.nanmin(shown), np.nanmax(shown)]))
    below, beyond = low < -SLACK, high > 1.0 + SLACK
    extend = ("both" if below else "max") if beyond else ("min" if below else "neither")
    colours = ScalarMappable(norm, quantity.colours)
    bar = _figure(panel).colorbar(
        colours, ax=panel, label=quantity.label, extend=extend, shrink=0.9, pad=0.02
    )
    if isinstance(norm, LogNorm):
        bar.ax.yaxis.set(major_formatter="{x:g}", minor_formatter="{x:g}")
    panel.set_title(quantity.title, fontsize=11)


def _states(
    panel: Axes,
    footprint: PressureMap,
    state: NDArray[np.uint8],
    title: str,
    melting: float = 0.0,
) -> None:
    """Dry, mixed, wet; `melting` (degC) is the temperature from which on ice is wet."""
    colours = ListedColormap(list(STATE_COLOURS.values()))
    edges = [each - 0.5 for each in (*STATE_COLOURS, State.WET + 1)]
    norm = BoundaryNorm(edges, len(STATE_COLOURS))
    shown = np.where(state == State.NO_CONTACT, np.nan, state)
    _image(panel, footprint, shown, cmap=colours, norm=norm)
    bar = _figure(panel).colorbar(
        ScalarMappable(norm, colours), ax=panel, ticks=list(STATE_COLOURS), shrink=0.9, pad=0.02
    )
    contact = np.count_nonzero(state)
    bar.ax.set_yticklabels(
        [
            f"{name}\n{np.count_nonzero(state == each) / contact:.0%}"
            for each, name in (
                (State.DRY, f"dry\n(< {melting + MIXED_FROM:g} °C)"),
                (State.MIXED, f"mixed\n(< {melting + WET_FROM:g} °C)"),
                (State.WET, f"wet\n(≥ {melting + WET_FROM:g} °C)"),
            )
        ]
    )
    panel.set_title(title, fontsize=11)


def _image(panel: Axes, footprint: PressureMap, values: Array, **options: Any) -> None:
    rows, columns = values.shape
    extent = (0.0, MM * footprint.dx * columns, 0.0, MM * footprint.dy * rows)
    panel.set_facecolor(NO_CONTACT)
    # Colours are found for the pixels shown alone: the same ones in a quarter of the time.
    options |= {"interpolation": "nearest", "interpolation_stage": "data"}
    panel.imshow(values, origin="lower", extent=extent, **options)
    panel.set(xlabel="x (mm), the tyre moves to the right", ylabel="y (mm)")


def _figure(panel: Axes) -> Figure:
    figure = panel.get_figure()
    assert isinstance(figure, Figure)
    return figure


def _save(figure: Figure, path: Path) -> Path:
    figure.savefig(path, dpi=DPI)
    return path
