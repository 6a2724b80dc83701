"""User data for every module: maps of pressure, temperature, state; profiles of a line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from iceslide_fem.preprocess.footprint.macroscopic import State, States
from iceslide_fem.preprocess.footprint.pressures import (
    check_pressures,
    is_sensor_text,
    pressure_unit,
    read_frame,
)
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import (
    Wanted,
    column_unit,
    find_columns,
    has_index,
    to_si_units,
    units_named,
)
from iceslide_fem.runtime.tables.grid import grid, is_list_of_points
from iceslide_fem.runtime.tables.layout import parse, read_table
from iceslide_fem.runtime.tables.text import LARGEST_MAP, read_text
from iceslide_fem.runtime.units import ZERO_CELSIUS

LARGEST = 4e7  # values of a map
EVEN = 1e-3  # of dx: tolerance of an even grid of a profile
COLDEST, WARMEST = -100.0, 100.0  # degC
COLUMNS = (
    Wanted("x", "m"),
    Wanted("pressure", "Pa"),
    Wanted("temperature", "K"),
    Wanted("state", ""),
)  # of a profile


class Profile(NamedTuple):
    """A line along the footprint, arrays (nx,): pressure (Pa); temperature (K) and state or None.

    dx, and x of the first pixel's middle: m.
    """

    dx: float
    first: float
    pressure: Array
    temperature: Array | None
    state: States | None


class GivenMap(NamedTuple):
    """A map (ny, nx) of a file, first row on top.

    unit: in the file; size: (length, width) in m, if it is in the file; notes: sentences for the
    user.
    """

    values: Array
    unit: str
    size: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()


def read_pressures(path: Path, unit: str | None = None, frame: int | None = None) -> GivenMap:
    """Pressures (Pa) of a map from a file; 0 where it has NaN.

    unit: of values in files without one, by default Pa; frame: number in a file of several.
    """
    given = _read_map(path, "--pressure-map", "Pa", unit, frame)
    values = np.nan_to_num(given.values, nan=0.0)
    check_pressures(values, f"--pressure-map {path}", given.unit)
    return given._replace(values=values)


def read_temperatures(path: Path) -> GivenMap:
    """Temperatures (K) of a map in degC, or in the unit that its file names."""
    given = _read_map(path, "--temperature-map", "K")
    _check_temperatures(given.values - ZERO_CELSIUS, f"--temperature-map {path}")
    return given


def read_states(path: Path) -> GivenMap:
    """`State` of a map: 1 dry, 2 mixed, 3 wet, 0 no contact."""
    given = _read_map(path, "--state-map", "")
    values = np.nan_to_num(given.values, nan=0.0)
    _check_states(values, f"--state-map {path}")
    return given._replace(values=values)


def read_profile(path: Path, unit: str | None = None) -> Profile:
    """A profile from a table with the columns x_m, pressure_Pa, optional temperature_C, state.

    Headings may name other units; unit: of a pressure without one in its heading. x is the middle
    of each pixel, evenly spaced, in the direction of travel. Raises SceneError.
    """
    table, given = _with_pressure_unit(read_table(path, "--line").filled(), unit)
    found = find_columns(table, COLUMNS, ("x", "pressure"))
    if len(table.heading) > len(found) + has_index(table):
        known = ", ".join(column.heading for column in COLUMNS)
        table.refuse(f"has the columns {', '.join(table.heading)[:120]}; allowed: {known}")
    x, pressure = found["x"], found["pressure"]
    if len(x) < 2:
        table.refuse(f"has {len(x)} row of numbers; allowed: two or more")
    for name, values in found.items():
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            table.refuse(f"{name} has no finite number in row {row + 1}")
    dx = float(x[-1] - x[0]) / (x.size - 1)
    if dx <= 0.0 or np.abs(np.diff(x) - dx).max() > EVEN * dx:
        table.refuse("x must rise in even steps, the direction of travel")
    if not 1e-6 <= dx <= 0.1:
        table.refuse(f"x rises by {dx:.3g} m; allowed: 1e-6 to 0.1 m")
    check_pressures(pressure, table.said, given)
    temperature, state = found.get("temperature"), None
    if temperature is not None:
        _check_temperatures(temperature - ZERO_CELSIUS, table.said)
    if "state" in found:
        _check_states(found["state"], table.said)
        state = found["state"].astype(np.uint8)
    return Profile(dx, float(x[0]), pressure, temperature, state)


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


def _read_map(
    path: Path, option: str, si: str, unit: str | None = None, frame: int | None = None
) -> GivenMap:
    """A table of numbers (ny, nx) in the unit `si`: .npy, text, or a sensor's frames."""
    said = f"{option} {path}"
    check_regular(path, f"the map of {option}")
    notes: tuple[str, ...] = ()
    named: list[str] = []
    if path.suffix.lower() == ".npy":
        values = _numpy(path, said)
    else:
        text = read_text(path, f"the map of {option}", LARGEST_MAP)
        if is_sensor_text(text) and si == "Pa":
            values, size, note = read_frame(text, said, frame)
            return GivenMap(values, "Pa", size, (note,))
        table = parse(text, said)
        if is_list_of_points(table):
            raise SceneError(
                f"{said} is a list of points x, y and value; allowed: a map, its rows across and "
                "its columns along the direction of travel"
            )
        values, left_out = grid(table)
        notes = tuple(f"{option}: {note}" for note in left_out)
        if si:
            named = units_named([*table.above, *table.heading], si)
    if frame is not None:
        raise SceneError(f"--frame {frame}: {said} has no frames")
    if min(values.shape) < 1 or values.shape[1] < 2 or values.size > LARGEST:
        raise SceneError(
            f"{said} has the shape {values.shape}; allowed: rows and columns, at "
            f"least 1 x 2 and at most {LARGEST:.0e} values"
        )
    if np.isinf(values).any():
        raise SceneError(f"{said} has a value that is infinite")
    if not si:
        return GivenMap(values, "", None, notes)
    if si == "Pa":
        given = pressure_unit(named, unit, said)
    else:
        given = named[0] if named else "degC"
    return GivenMap(to_si_units(values, given, si), given, None, notes)


def _numpy(path: Path, said: str) -> Array:
    try:
        values = np.load(path, allow_pickle=False)
        if not isinstance(values, np.ndarray) or values.ndim != 2:
            raise ValueError
        return np.asarray(values, dtype=float)
    except (EOFError, OSError, TypeError, ValueError, BadZipFile):
        raise SceneError(f"{said} is no matrix of numbers that NumPy has saved") from None


def _check_temperatures(celsius: Array, said: str) -> None:
    if np.isnan(celsius).all():
        raise SceneError(f"{said} has no temperature in it")
    low, high = float(np.nanmin(celsius)), float(np.nanmax(celsius))
    if not COLDEST <= low <= high <= WARMEST:
        raise SceneError(
            f"{said} has temperatures from {low:.4g} to {high:.4g}; allowed: {COLDEST:g} to "
            f"{WARMEST:g} degC"
        )


def _check_states(values: Array, said: str) -> None:
    if not np.isin(values, list(State)).all():
        raise SceneError(
            f"{said} has other states than 0 (no contact), 1 (dry), 2 (mixed) and 3 (wet)"
        )
