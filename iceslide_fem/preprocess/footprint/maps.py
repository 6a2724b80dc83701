"""Maps of pressure, temperature and state from files of the user's own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from iceslide_fem.preprocess.footprint.macroscopic import State
from iceslide_fem.preprocess.footprint.point_list import GivenMap, read_points
from iceslide_fem.preprocess.footprint.sensor_text import is_sensor_text, read_frame
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular
from iceslide_fem.runtime.tables.columns import to_si_units, units_named
from iceslide_fem.runtime.tables.grid import LARGEST_MAP, grid, read_matrix, read_text
from iceslide_fem.runtime.tables.layout import parse
from iceslide_fem.runtime.units import ZERO_CELSIUS, to_si
from iceslide_fem.scene.materials import BAR

HIGHEST = 100.0 * BAR
# Mean contact pressures of a tyre or block, Pa: plausible range, and usual range.
PLAUSIBLE = 5e3, 5e6
USUAL = 2e4, 1.5e6
UNITS = ("Pa", "kPa", "bar", "MPa", "psi", "N/cm^2")


def pressure_unit(named: Sequence[str], option: str | None, said: str) -> str:
    """The unit of pressures: `named` in the file, else --pressure-unit, else Pa.

    Raises SceneError if they contradict each other.
    """
    factors = {_pascals(unit) for unit in named}
    if len(factors) > 1 and option is None:
        raise SceneError(f"{said} names the units {', '.join(named)}; --pressure-unit says which")
    if len(factors) == 1 and option is not None and _pascals(option) not in factors:
        raise SceneError(f"--pressure-unit {option} contradicts {said}, which is in {named[0]}")
    return option or (named[0] if named else "Pa")


def check_pressures(values: Array, said: str, unit: str) -> None:
    """Raise SceneError unless pressures (Pa) are 0 to 100 bar, with a plausible mean in contact.

    unit: of the given values; the message suggests units that make them usual.
    """
    low, high, factor = float(values.min()), float(values.max()), _pascals(unit)
    if high == 0.0 <= low:
        raise SceneError(f"{said}: no pressure is above 0, nothing is in contact")
    mean = float(values[values > 0.0].mean()) if high > 0.0 else float("nan")
    usual = [each for each in UNITS if USUAL[0] <= mean / factor * _pascals(each) <= USUAL[1]]
    hint = ""
    if usual:
        units = " or ".join(usual)
        hint = f" (are they in {units}? a heading or --pressure-unit {usual[0]} says so)"
    if low < 0.0 or high > HIGHEST:
        raise SceneError(
            f"{said} has pressures from {low / factor:.4g} to {high / factor:.4g} {unit}; allowed: "
            f"0 to {HIGHEST / factor:.4g} {unit}{hint}"
        )
    if not PLAUSIBLE[0] <= mean <= PLAUSIBLE[1]:
        raise SceneError(
            f"{said} has a mean pressure of {mean / factor:.4g} {unit} where it touches, which is "
            f"none of a tyre; allowed: {PLAUSIBLE[0] / BAR:g} to {PLAUSIBLE[1] / BAR:g} bar{hint}"
        )


def _pascals(unit: str) -> float:
    return to_si(f"1 {unit}", "Pa")


LARGEST = 4e7  # values of a map
COLDEST, WARMEST = -100.0, 100.0  # degC


def read_pressures(path: Path, unit: str | None = None, frame: int | None = None) -> GivenMap:
    """Pressures (Pa) of a map from a file; 0 where it has NaN.

    unit: of values in files without one, by default Pa; frame: number in a file of several.
    """
    given = _read_map(path, "--pressure-map", "Pa", unit, frame)
    values = np.nan_to_num(given.values, nan=0.0)
    check_pressures(values, f"--pressure-map {path}", given.units[0])
    return given._replace(values=values)


def read_temperatures(path: Path) -> GivenMap:
    """Temperatures (K) of a map in degC, or in the unit that its file names."""
    given = _read_map(path, "--temperature-map", "K")
    check_temperatures(given.values - ZERO_CELSIUS, f"--temperature-map {path}")
    return given


def read_states(path: Path) -> GivenMap:
    """`State` of a map: 1 dry, 2 mixed, 3 wet, 0 no contact."""
    given = _read_map(path, "--state-map", "")
    values = np.nan_to_num(given.values, nan=0.0)
    check_states(values, f"--state-map {path}")
    return given._replace(values=values)


def check_temperatures(celsius: Array, said: str) -> None:
    """Raise SceneError unless there are temperatures (degC), all of them of ice and tyres."""
    if np.isnan(celsius).all():
        raise SceneError(f"{said} has no temperature in it")
    low, high = float(np.nanmin(celsius)), float(np.nanmax(celsius))
    if not COLDEST <= low <= high <= WARMEST:
        raise SceneError(
            f"{said} has temperatures from {low:.4g} to {high:.4g}; allowed: {COLDEST:g} to "
            f"{WARMEST:g} degC"
        )


def check_states(values: Array, said: str) -> None:
    """Raise SceneError unless all values are of `State`."""
    if not np.isin(values, list(State)).all():
        raise SceneError(
            f"{said} has other states than 0 (no contact), 1 (dry), 2 (mixed) and 3 (wet)"
        )


def _read_map(
    path: Path, option: str, si: str, unit: str | None = None, frame: int | None = None
) -> GivenMap:
    """Numbers (ny, nx) in the unit `si`: .npy, text, a list of points, or a sensor's frames."""
    said = f"{option} {path}"
    check_regular(path, f"the map of {option}")
    if path.suffix.lower() == ".npy":
        read = GivenMap(read_matrix(path, said))
    else:
        text = read_text(path, f"the map of {option}", LARGEST_MAP)
        if si == "Pa" and is_sensor_text(text):
            read, frame = read_frame(text, said, frame), None
        else:
            read = _read_text(text, said, option, si)
    if frame is not None:
        raise SceneError(f"--frame {frame}: {said} has no frames")
    values = read.values
    if min(values.shape) < 1 or values.shape[1] < 2 or values.size > LARGEST:
        raise SceneError(
            f"{said} has the shape {values.shape}; allowed: rows and columns, at "
            f"least 1 x 2 and at most {LARGEST:.0e} values"
        )
    if np.isinf(values).any():
        raise SceneError(f"{said} has a value that is infinite")
    if not si:
        return read
    if si == "Pa":
        given = pressure_unit(read.units, unit, said)
    else:
        given = read.units[0] if read.units else "degC"
    return read._replace(values=to_si_units(values, given, si), units=(given,))


def _read_text(text: str, said: str, option: str, si: str) -> GivenMap:
    """A matrix, or a list of points."""
    table = parse(text, said)
    if (points := read_points(table, si)) is not None:
        return points._replace(notes=tuple(f"{option}: {note}" for note in points.notes))
    names = {re.sub(r"[\d\W_]+", "", name).casefold() for name in table.heading[1:]} - {""}
    first = list(table.heading) or next(table.rows())
    if len(names) > 1 or first[0].strip('"').casefold().startswith("time"):
        table.refuse(
            f"has the columns {', '.join(first)[:60]}; allowed: a map, whose columns have no names "
            "of their own, or x, y and a pressure"
        )
    values, left_out = grid(table)
    named = units_named([*table.above, *table.heading], si) if si else []
    return GivenMap(values, named, notes=tuple(f"{option}: {note}" for note in left_out))
