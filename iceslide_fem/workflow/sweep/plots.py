"""Pictures of a sweep: friction against every varied quantity, and maps over pairs."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iceslide_fem.postprocess.results.style import BLUE
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR

DPI = 130
PICTURES = ("mu_by_*.png", "map_*.png")
MOST_LINES, MOST_PANELS = 8, 3


class SummaryQuantity(NamedTuple):
    """Display of a key: name with unit, and factor and offset from SI."""

    label: str
    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, values: Any) -> Array:
        """Convert SI values for display."""
        return np.asarray((np.asarray(values) - self.offset) * self.factor)


SHOWN = {
    "load.pressure": SummaryQuantity("pressure (bar)", 1.0 / BAR),
    "load.speed": SummaryQuantity("speed (m/s)"),
    "load.duration": SummaryQuantity("duration (ms)", 1e3),
    "ice.temperature": SummaryQuantity("ice temperature (°C)", 1.0, ZERO_CELSIUS),
    "rubber.length": SummaryQuantity("length (mm)", 1e3),
    "rubber.width": SummaryQuantity("width (mm)", 1e3),
    "rubber.height": SummaryQuantity("height (mm)", 1e3),
    "film.initial_height": SummaryQuantity("initial film height (nm)", 1e9),
    "film.dry_stress": SummaryQuantity("stress of dry contact (bar)", 1.0 / BAR),
    "film.dry_softening": SummaryQuantity("softening of dry contact (K)"),
    "film.dry_residual": SummaryQuantity("dry contact above melting (K)"),
    "film.D": SummaryQuantity("asperity diameter $D$ (µm)", 1e6),
    "film.H_V": SummaryQuantity("free height $H_V$ (µm)", 1e6),
    "film.k": SummaryQuantity("relative contact area $k$"),
}


def plot_sweep(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Draw all pictures of a sweep into `folder`; their paths. Nothing if no case is done."""
    for pattern in PICTURES:  # of an earlier sweep, perhaps with other keys
        for earlier in folder.glob(pattern):
            earlier.unlink()
    if not np.isfinite(dataset["mu"]).any():
        return []
    numeric = [key for key in _varied(dataset) if dataset[key].dtype.kind in "if"]
    dataset = dataset.sortby(numeric)
    paths = []
    for key in numeric:
        paths.append(folder / f"mu_by_{key}.png")
        friction_against(dataset, key).savefig(paths[-1], dpi=DPI)
    for first, second in itertools.combinations(numeric, 2):
        paths.append(folder / f"map_{first}_{second}.png")
        maps(dataset, first, second).savefig(paths[-1], dpi=DPI)
    return paths


def friction_against(dataset: xr.Dataset, key: str) -> Figure:
    """Mean mu against `key`, with the next varied key as colour and one more as panels.

    If there are more values than lines or panels, the picture says how many it shows.
    """
    others = [other for other in _varied(dataset) if other != key]
    colour, panel = [*others, None, None][:2]
    mean, rest = _middle(dataset["mu_mean"], others[2:])
    panels = _spread(dataset[panel].values, MOST_PANELS) if panel else [None]
    if panel and len(panels) < dataset.sizes[panel]:
        name = quantity_of(panel).label.partition(" (")[0]
        share = f"{len(panels)} of {dataset.sizes[panel]} values of {name}"
        rest = ", ".join(filter(None, [share, rest]))
    figure = Figure(figsize=(2.0 + 3.6 * len(panels), 4.0), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for ax, at in zip(axes, panels, strict=True):
        here = mean if panel is None else mean.sel({panel: at})
        if panel is not None:
            ax.set_title(_told(panel, at), fontsize=10)
        _lines(ax, here, key, colour)
    axes[0].set_ylabel(r"mean friction coefficient $\bar\mu$")
    axes[0].set_ylim(bottom=0.0)
    if colour is not None:
        title, drawn, there = quantity_of(colour).label, len(axes[-1].lines), dataset.sizes[colour]
        title += f"\n{drawn} of {there} values" if drawn < there else ""
        axes[-1].legend(title=title, frameon=False, fontsize=8, title_fontsize=9)
    figure.suptitle(_title(dataset, "Friction", rest))
    return figure


def maps(dataset: xr.Dataset, first: str, second: str) -> Figure:
    """Mean mu, film height at the end and melt onset over two varied keys."""
    others = [key for key in _varied(dataset) if key not in (first, second)]
    end = dataset["film_height_m"].isel(time_share=-1)
    panels = {
        r"mean friction coefficient $\bar\mu$": dataset["mu_mean"],
        "film height at the end (nm)": 1e9 * end,
        "melt onset (ms); hatched: none": 1e3 * dataset["melt_onset_s"],
    }
    figure = Figure(figsize=(13.0, 4.2), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True)
    x, y = quantity_of(first), quantity_of(second)
    across, up = x(dataset[first].values), y(dataset[second].values)
    rest = ""
    for ax, (name, values) in zip(axes, panels.items(), strict=True):
        here, rest = _middle(values, others)
        ax.set_facecolor("0.93")
        ax.patch.set(hatch="///", edgecolor="0.75")
        shown = here.transpose(second, first).to_numpy()
        figure.colorbar(ax.pcolormesh(across, up, shown, shading="nearest"), ax=ax)
        # outer cells are half as wide: no colour beyond the values
        ax.set(title=name, xlabel=x.label, xlim=(across.min(), across.max()))
        ax.set_ylim(up.min(), up.max())
    axes[0].set_ylabel(y.label)
    figure.suptitle(_title(dataset, "Maps", rest))
    return figure


def _lines(ax: Axes, values: xr.DataArray, key: str, colour: str | None) -> None:
    x = quantity_of(key)(values[key].values)
    if colour is None:
        ax.plot(x, values.to_numpy(), "o-", color=BLUE)
    else:
        chosen = _spread(values[colour].values, MOST_LINES)
        shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, len(chosen)))
        for shade, at in zip(shades, chosen, strict=True):
            line, label = values.sel({colour: at}).to_numpy(), _number(colour, at)
            ax.plot(x, line, "o-", color=shade, label=label, markersize=4)
    ax.set_xlabel(quantity_of(key).label)
    ax.grid(alpha=0.25)
    ax.spines[["top", "right"]].set_visible(False)


def _varied(dataset: xr.Dataset) -> list[str]:
    """Keys with more than one value."""
    return [str(key) for key, size in dataset["status"].sizes.items() if size > 1]


def _middle(values: xr.DataArray, keys: Sequence[str]) -> tuple[xr.DataArray, str]:
    """`values` at the middle of each of `keys`, and of keys with one value; words for it."""
    words = []
    for key in keys:
        at = values[key].values[values.sizes[key] // 2]
        words.append(_told(key, at))
        values = values.sel({key: at})
    return values.squeeze(drop=True), ", ".join(words)


def _spread(values: Array, most: int) -> list[Any]:
    """At most `most` of `values`, with the first and the last."""
    chosen = np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(int))
    return [values[number] for number in chosen]


def quantity_of(key: Hashable) -> SummaryQuantity:
    """Display of a dotted key."""
    return SHOWN.get(str(key), SummaryQuantity(str(key)))


def _number(key: str, value: Any) -> str:
    if isinstance(value, str | bool | np.bool_):
        return str(value).lower()
    return f"{quantity_of(key)(value):.4g}"


def _told(key: str, value: Any) -> str:
    """ "pressure 2 bar" """
    name, _, unit = quantity_of(key).label.partition(" (")
    return f"{name} {_number(key, value)} {unit.rstrip(')')}".strip()


def _title(dataset: xr.Dataset, what: str, rest: str) -> str:
    words = [str(dataset.attrs["name"]), str(dataset.attrs["model"]), rest]
    return f"{what}: " + ", ".join(word for word in words if word)
