"""Charts of a sweep: friction against every varied quantity, and maps over pairs."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from iceslide_fem.postprocess.report.page import Chart, Curve, HeatMap
from iceslide_fem.postprocess.report.png import save_png
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import Quantity
from iceslide_fem.runtime.units import ZERO_CELSIUS

PICTURES = ("mu_by_*.png", "map_*.png")
MOST_CURVES = 12


# Keys in SI, as they are shown.
SHOWN = (
    Quantity("load.pressure", "pressure", "bar"),
    Quantity("load.speed", "speed", "m/s"),
    Quantity("load.duration", "duration", "ms"),
    Quantity("ice.temperature", "ice temperature", "°C"),
    Quantity("rubber.length", "length", "mm"),
    Quantity("rubber.width", "width", "mm"),
    Quantity("rubber.height", "height", "mm"),
    Quantity("film.initial_height", "initial film height", "nm"),
    Quantity("film.dry_stress", "stress of dry contact", "bar"),
    Quantity("film.dry_softening", "softening of dry contact", "K"),
    Quantity("film.dry_residual", "dry contact above melting", "K"),
    Quantity("film.D", "asperity diameter D", "µm"),
    Quantity("film.H_V", "free height H_V", "µm"),
    Quantity("film.k", "relative contact area k"),
)


def plot_sweep(data: xr.Dataset, folder: Path) -> list[Path]:
    """Draw all pictures of a sweep into `folder`; their paths. Nothing if no case is done."""
    for pattern in PICTURES:  # of an earlier sweep, perhaps with other keys
        for earlier in folder.glob(pattern):
            earlier.unlink()
    paths = []
    for name, parts in charts_of_sweep(data).items():
        paths.append(folder / f"{name}.png")
        save_png(parts, paths[-1], ", ".join(filter(None, map(data.attrs.get, ("name", "model")))))
    return paths


def charts_of_sweep(data: xr.Dataset) -> Mapping[str, Sequence[Chart | HeatMap]]:
    """Charts by the names of pictures; none if no case is done."""
    if "mu_mean" not in data or not np.isfinite(data["mu_mean"]).any():
        return {}
    keys = keys_of(data)
    numeric = [key for key in keys if data[key].dtype.kind in "if" and data.sizes[key] > 1]
    data = data.sortby(numeric)
    found: dict[str, Sequence[Chart | HeatMap]] = {
        f"mu_by_{key}": [_over(data, key, [one for one in keys if one != key])] for key in numeric
    }
    for first, second in itertools.combinations(numeric, 2):
        rest = [key for key in keys if key not in (first, second)]
        found[f"map_{first}_{second}"] = _maps(data, first, second, rest)
    return found


def _over(data: xr.Dataset, key: str, others: list[str]) -> Chart:
    """Mean mu over `key`, a curve for each combination of the `others`."""
    look, combinations = quantity_of(key), list(places(data, others))
    drawn = [
        (at, data["mu_mean"].isel(at).to_numpy())
        for at in spread(combinations, MOST_CURVES)
        if np.isfinite(data["mu_mean"].isel(at)).any()
    ]
    x = shown(look, data[key])
    curves = [Curve(words(data, at) or "mean mu", x, mu, n) for n, (at, mu) in enumerate(drawn)]
    values = [mu for _, mu in drawn]
    says = f"Mean mu is between {np.nanmin(values):.4g} and {np.nanmax(values):.4g}"
    if len(curves) < len(combinations):
        says += f"; {len(curves)} of {len(combinations)} combinations are drawn"
    title, anchor = f"Mean mu over {look.label}", f"over-{key.replace('.', '-')}"
    return Chart(anchor, title, says, look.label, "mean mu", curves)


def _maps(data: xr.Dataset, first: str, second: str, rest: list[str]) -> list[HeatMap]:
    """Mean mu, film height at the end and melt onset over two keys, the rest at their middle."""
    at = {key: data.sizes[key] // 2 for key in rest}
    x, y = quantity_of(first), quantity_of(second)
    where = f", {there}" if (there := words(data, at)) else ""
    drawn = []
    for name, unit, values in (
        ("Mean mu", "", data["mu_mean"]),
        ("Film height at the end", "nm", 1e9 * data["film_height_m"].isel(time_share=-1)),
        ("Melt onset; grey: none", "ms", 1e3 * data["melt_onset_s"]),
    ):
        here = values.isel(at).transpose(second, first).to_numpy()
        if np.isfinite(here).any():
            anchor = f"map-{name.split()[0]}-{first}-{second}".replace(".", "-").lower()
            says = f"Between {np.nanmin(here):.4g} and {np.nanmax(here):.4g} {unit}".strip()
            axes = shown(x, data[first]), shown(y, data[second])
            drawn.append(
                HeatMap(anchor, f"{name}{where}", says, x.label, y.label, unit, axes, here)
            )
    return drawn


def over_time(data: xr.Dataset) -> list[Chart]:
    """mu(t) of some cases."""
    done = [at for at in places(data, keys_of(data)) if np.isfinite(data["mu"].isel(at)).any()]
    curves = [
        Curve(
            words(data, at) or "mu",
            1e3 * float(data["duration_s"].isel(at)) * data["time_share"].values,
            data["mu"].isel(at).to_numpy(),
            look,
        )
        for look, at in enumerate(spread(done, MOST_CURVES))
    ]
    says = f"mu(t) of {len(curves)} of {len(done)} cases"
    return [Chart("mu", "mu(t)", says, "sliding time (ms)", "mu (1)", curves)] if curves else []


def keys_of(data: xr.Dataset) -> list[str]:
    """The varied keys."""
    return [str(key) for key in data.dims if key != "time_share"]


def places(data: xr.Dataset, keys: Sequence[str]) -> Iterator[dict[str, int]]:
    """Indices of the values of `keys` for every combination, the last varying fastest."""
    for indices in itertools.product(*(range(data.sizes[key]) for key in keys)):
        yield dict(zip(keys, indices, strict=True))


def spread(values: Sequence[Any], most: int) -> list[Any]:
    """At most `most` of `values`, with the first and the last."""
    chosen = np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(int))
    return [values[number] for number in chosen]


def words(data: xr.Dataset, at: Mapping[str, int]) -> str:
    """The values of a case or of some keys of it, in short."""
    said = []
    for key, index in at.items():
        if data.sizes[key] > 1:
            look = quantity_of(key)
            said.append(f"{look.title} {value_of(data, key, index)} {look.unit}".strip())
    return ", ".join(said)


def value_of(data: xr.Dataset, key: str, index: int) -> str:
    """A value of a key as text, in its unit for display."""
    value = data[key].values[index]
    numeric = data[key].dtype.kind in "if"
    return f"{float(shown(quantity_of(key), value)):.4g}" if numeric else str(value)


def quantity_of(key: Hashable) -> Quantity:
    """Display of a dotted key."""
    return next((each for each in SHOWN if each.column == key), Quantity(str(key), str(key)))


def shown(quantity: Quantity, values: Any) -> Array:
    """Values of a key, SI, in the unit in which it is shown."""
    zero = ZERO_CELSIUS if quantity.unit == "°C" else 0.0
    return np.asarray((np.asarray(values) - zero) * quantity.factor)
