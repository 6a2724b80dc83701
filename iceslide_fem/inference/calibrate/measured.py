"""Measured friction: a table of loads and mu, or of mu over time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.runs.many_points import KEYS, Rows
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import Wanted, check_range, find_columns, read_columns
from iceslide_fem.runtime.tables.layout import read_table
from iceslide_fem.scene import Scene
from iceslide_fem.scene.variation import number_at, parameter

LOADS = (
    Wanted("speed", "m/s", ("v", "velocity", "sliding speed", "speed_m_s")),
    Wanted("pressure", "Pa", ("p", "nominal pressure", "contact pressure")),
    Wanted("temperature", "K", ("T", "ice temperature")),
    Wanted("duration", "s", ("time of sliding",)),
)
MU = Wanted("mu", "", ("friction coefficient", "cof", "µ", "μ"))
FORCE = Wanted("friction_force", "N", ("friction force",))
SIGMA = Wanted("sigma_mu", "", ("std_mu", "mu_std"))
SERIES = "series"
OF_SERIES = (Wanted("time", "s", ("t",)), MU)
LARGEST = 10.0  # mu
_WITH_UNIT = re.compile(r"[+-]?\d[\d.]* ?(?:[a-zA-Z°%][\w/°]*)")  # a cell such as 0.5 m/s
NOISE = 0.05  # standard deviation of mu over mu where neither data nor user say one


class Series(NamedTuple):
    """mu over time of rows: at `times` (s), (n, times), NaN where a row has no value."""

    times: Array
    mu: Array


class Measured(NamedTuple):
    """Measured friction of n rows.

    rows: their loads; mu, sigma (n,): of the whole row, and its standard deviation over mu; series:
    instead of mu, or None; known: whether sigma was given; said: the table's name in messages;
    varied: which loads the table has.
    """

    rows: Rows
    mu: Array
    sigma: Array
    series: Series | None
    known: bool
    said: str
    varied: tuple[str, ...]

    @property
    def number(self) -> int:
        """n."""
        return self.mu.size


def read_measured(
    path: Path, scene: Scene, over: float | None = None, noise: float | None = None
) -> Measured:
    """The rows of a table; loads that it does not have are those of the `scene`.

    over: sliding distance (m) of every row instead of its duration; noise: standard deviation of mu
    over mu, instead of that of the table. Raises SceneError with one sentence.
    """
    table = read_table(path, "the data").filled()
    names = [each.strip().casefold() for each in table.heading]
    wanted = [*LOADS, FORCE, SIGMA, *([] if SERIES in names else [MU])]
    found = find_columns(table, wanted, ())
    if SERIES in names:
        series = _series(path, table, names.index(SERIES))
        mu = np.nanmean(series.mu, axis=1)
    else:
        series, mu = None, _friction(table, found, scene)
    loads = {each.name: found[each.name] for each in LOADS if each.name in found}
    for name, values in loads.items():
        limits = parameter(KEYS[name])
        check_range(table, name, values, limits.low, limits.high)
    if over is not None:
        if "duration" in loads:
            table.refuse("has durations, and --over gives a sliding distance instead; give one")
        speed = loads.get("speed", np.full(mu.size, number_at(scene, KEYS["speed"])))
        loads["duration"] = over / speed
    if not loads:
        table.refuse("has no column of loads; allowed: speed, pressure, temperature, duration")
    sigma = np.full(mu.size, NOISE if noise is None else noise)
    if noise is None and "sigma_mu" in found:
        check_range(table, "sigma_mu", found["sigma_mu"], 1e-9, LARGEST)
        sigma = found["sigma_mu"] / mu
    known = noise is not None or "sigma_mu" in found
    return Measured(Rows(**loads), mu, sigma, series, known, table.said, tuple(loads))


def _friction(table: TextTable, found: dict[str, Array], scene: Scene) -> Array:
    """mu of the rows, from mu or from forces on the scene's nominal area."""
    if ("mu" in found) == ("friction_force" in found):
        if not found and (cell := _WITH_UNIT.search(table.lines[0].text)):
            table.refuse(
                f'has "{cell[0]}" in line {table.lines[0].number}; allowed: plain numbers, with '
                "the unit in the heading, as in speed (m/s)"
            )
        what = "both of" if "mu" in found else "neither of"
        table.refuse(f"has {what} mu and friction_force_N; allowed: one of them, or {SERIES}")
    mu = found.get("mu")
    if mu is None:
        pressure = found.get("pressure", np.full(len(table.lines), scene.load.pressures.first))
        area = scene.rubber.length * scene.rubber.width
        mu = found["friction_force"] / (pressure * area)
    check_range(table, "mu", mu, 1e-9, LARGEST)
    return mu


def _series(path: Path, table: TextTable, column: int) -> Series:
    """mu over time of the files that a column names, beside the table; at all their times."""
    each = []
    for row in table.rows():
        file = path.parent / row[column]
        if not file.is_file():
            table.refuse(f"names the series {row[column]}, and there is no file {file}")
        one, found = read_columns(file, "the series", OF_SERIES, ["time", "mu"])
        check_range(one, "mu", found["mu"], 1e-9, LARGEST)
        if (np.diff(found["time"]) <= 0.0).any():
            raise SceneError(f"{one.said}: times must rise from row to row")
        each.append(found)
    times = np.unique(np.concatenate([found["time"] for found in each]))
    mu = np.full((len(each), times.size), np.nan)
    for values, found in zip(mu, each, strict=True):
        values[np.searchsorted(times, found["time"])] = found["mu"]
    return Series(times, mu)
