"""A line along a footprint from a table: points with straight lines between them, or cells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.macroscopic import States
from iceslide_fem.preprocess.footprint.maps import (
    check_pressures,
    check_states,
    check_temperatures,
    pressure_unit,
)
from iceslide_fem.preprocess.footprint.pressure_map import LINE_PIXELS
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import (
    Wanted,
    column_unit,
    find_columns,
    has_index,
    places,
)
from iceslide_fem.runtime.tables.layout import read_table
from iceslide_fem.runtime.units import ZERO_CELSIUS

EVEN = 1e-3  # of dx: tolerance of even cells
SHORTEST, LONGEST = 1e-5, 5.0  # of a line, m
POINT, CELL = Wanted("x", "m"), Wanted("cell", "m")
COLUMNS = (
    POINT,
    CELL,
    Wanted("pressure", "Pa"),
    Wanted("temperature", "K"),
    Wanted("state", ""),
)


class Profile(NamedTuple):
    """A line along the footprint, arrays (nx,): pressure (Pa); temperature (K) and state or None.

    dx, and x of the first pixel's middle: m.
    """

    dx: float
    first: float
    pressure: Array
    temperature: Array | None
    state: States | None


def read_profile(path: Path, unit: str | None = None) -> Profile:
    """A profile from a table with the columns x_m, pressure_Pa, optional temperature_C, state.

    Pressure and temperature are straight between the points x, which rise in the direction of
    travel, and the line ends at the first and the last one. With the column cell_m instead of x_m
    each row is a cell with its middle there; cells are of even length, and join. Headings may name
    other units; unit: of a pressure without one in its heading. Raises SceneError.
    """
    table, given = _with_pressure_unit(read_table(path, "--line").filled(), unit)
    of_cells = bool(places(table, CELL)) and not places(table, POINT)
    found = find_columns(table, COLUMNS, ("cell" if of_cells else "x", "pressure"))
    if len(table.heading) > len(found) + has_index(table) or {"x", "cell"} <= set(found):
        known = ", ".join(column.heading for column in COLUMNS)
        table.refuse(
            f"has the columns {', '.join(table.heading)[:120]}; allowed: {known}, of which x_m is "
            "of points and cell_m of cells"
        )
    x = found.pop("cell" if of_cells else "x")
    if len(x) < 2:
        table.refuse(f"has {len(x)} row of numbers; allowed: two or more")
    for name, values in {"x": x, **found}.items():
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            table.refuse(f"{name} has no finite number in row {row + 1}")
    if (np.diff(x) <= 0.0).any():
        table.refuse("x must rise, in the direction of travel")
    if not SHORTEST <= x[-1] - x[0] <= LONGEST:
        table.refuse(f"x covers {x[-1] - x[0]:.3g} m; allowed: {SHORTEST:g} to {LONGEST:g} m")
    check_pressures(found["pressure"], table.said, given)
    if "temperature" in found:
        check_temperatures(found["temperature"] - ZERO_CELSIUS, table.said)
    if "state" in found:
        check_states(found["state"], table.said)
    return _cells(table, x, found) if of_cells else _between(x, found)


def _cells(table: TextTable, x: Array, found: dict[str, Array]) -> Profile:
    """The rows as cells around `x`."""
    dx = float(x[-1] - x[0]) / (x.size - 1)
    if np.abs(np.diff(x) - dx).max() > EVEN * dx:
        table.refuse("cell must rise in even steps: cells are of one length")
    state = found["state"].astype(np.uint8) if "state" in found else None
    return Profile(dx, float(x[0]), found["pressure"], found.get("temperature"), state)


def _between(x: Array, found: dict[str, Array]) -> Profile:
    """Means over cells of the straight lines between points, with states of the nearest points.

    There is a whole number of cells between evenly spaced points, so that contact begins and ends
    where the points say.
    """
    parts = -(-LINE_PIXELS // (x.size - 1))
    edges = np.linspace(x[0], x[-1], parts * (x.size - 1) + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    pressure, temperature, state = (
        found.get(name) for name in ("pressure", "temperature", "state")
    )
    assert pressure is not None
    dx = float(edges[-1] - edges[0]) / middles.size
    if temperature is not None:
        temperature = np.interp(middles, x, temperature)
    if state is not None:
        touching = np.flatnonzero(pressure)
        nearest = np.rint(np.interp(middles, x[touching], np.arange(touching.size))).astype(int)
        state = state[touching[nearest]].astype(np.uint8)
    return Profile(dx, float(middles[0]), _means(x, pressure, edges), temperature, state)


def _means(x: Array, values: Array, edges: Array) -> Array:
    """Exact means, between `edges`, of straight lines between values at `x`."""
    slope = np.diff(values) / np.diff(x)
    before = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(x))])
    at = np.clip(np.searchsorted(x, edges, side="right") - 1, 0, x.size - 2)
    along = edges - x[at]
    integral = before[at] + along * (values[at] + 0.5 * slope[at] * along)
    return np.maximum(np.diff(integral) / np.diff(edges), 0.0)


def _with_pressure_unit(table: TextTable, unit: str | None) -> tuple[TextTable, str]:
    """The table with the unit of its pressure in the heading, and that unit."""
    units = [column_unit(table, i, "Pa") for i in range(len(table.heading))]
    named = [each for each in units if each is not None]
    if unit and not named:
        plain = (name.strip().casefold() == "pressure" for name in table.heading)
        names = zip(table.heading, plain, strict=True)
        heading = tuple(f"pressure ({unit})" if bare else name for name, bare in names)
        table = replace(table, heading=heading)
    return table, pressure_unit(named, unit, table.said)
