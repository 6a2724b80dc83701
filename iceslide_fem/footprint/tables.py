"""Data of one's own for every module: maps of pressure, temperature, state; profiles of a line."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array
from iceslide_fem.errors import SceneError
from iceslide_fem.footprint.balance import State
from iceslide_fem.materials import BAR, ZERO_CELSIUS
from iceslide_fem.scene.input_file import check_regular, read_text

LARGEST = 4e7  # values of a map
EVEN = 1e-3  # of dx, by which the x of a profile may miss an even grid
HIGHEST = 100.0 * BAR
COLDEST, WARMEST = -100.0, 100.0  # degC


class Profile(NamedTuple):
    """A line along the footprint, arrays (nx,): pressure (Pa); temperature (K) and state or None.

    dx, and x of the first pixel's middle: m.
    """

    dx: float
    first: float
    pressure: Array
    temperature: Array | None
    state: NDArray[np.uint8] | None


def read_pressures(path: Path) -> Array:
    """Pressures (Pa) of a map (ny, nx) from a file, its first row on top; 0 where it has NaN."""
    values = np.nan_to_num(_read_map(path, "--pressure-map"), nan=0.0)
    _check_pressures(values, f"--pressure-map {path}")
    return values


def read_temperatures(path: Path) -> Array:
    """Temperatures (K) of a map in degC."""
    celsius = _read_map(path, "--temperature-map")
    _check_temperatures(celsius, f"--temperature-map {path}")
    return celsius + ZERO_CELSIUS


def read_states(path: Path) -> NDArray[np.uint8]:
    """`State` of a map: 1 dry, 2 mixed, 3 wet, 0 no contact."""
    values = np.nan_to_num(_read_map(path, "--state-map"), nan=0.0)
    _check_states(values, f"--state-map {path}")
    return values.astype(np.uint8)


def read_profile(path: Path) -> Profile:
    """A profile from CSV with a head: x_m (or x_mm), pressure_Pa (or pressure_bar), and perhaps
    temperature_C and state.

    x is the middle of each pixel, evenly spaced, in the direction of travel. Raises SceneError.
    """
    said = f"--line {path}"
    head, *lines = [
        line for line in read_text(path, "the profile").splitlines() if line.strip()
    ] or [""]
    names = [name.strip() for name in head.split(",")]
    known = {"x_m", "x_mm", "pressure_Pa", "pressure_bar", "temperature_C", "state"}
    for name in names:
        if name not in known:
            raise SceneError(
                f'{said} has a column "{name[:40]}"; allowed: {", ".join(sorted(known))}'
            )
    if len(set(names)) < len(names):
        raise SceneError(f"{said} has a column twice")
    try:
        rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    except ValueError:
        raise SceneError(f"{said}: every row below the head must be {len(names)} numbers") from None
    if rows.ndim != 2 or rows.shape[1:] != (len(names),) or len(rows) < 2:
        raise SceneError(
            f"{said}: below the head there must be rows of {len(names)} numbers, two or more"
        )
    if not np.isfinite(rows).all():
        raise SceneError(f"{said} has a value that is no finite number")
    columns = dict(zip(names, rows.T, strict=True))

    def one_of(first: str, second: str, factor: float) -> Array:
        if (first in columns) == (second in columns):
            raise SceneError(f"{said} needs one column {first} or {second}")
        return columns[first] if first in columns else factor * columns[second]

    x, pressure = one_of("x_m", "x_mm", 1e-3), one_of("pressure_Pa", "pressure_bar", BAR)
    dx = float(x[-1] - x[0]) / (x.size - 1)
    if dx <= 0.0 or np.abs(np.diff(x) - dx).max() > EVEN * dx:
        raise SceneError(f"{said}: x must rise in even steps, the direction of travel")
    if not 1e-6 <= dx <= 0.1:
        raise SceneError(f"{said}: x rises by {dx:.3g} m; allowed: 1e-6 to 0.1 m")
    _check_pressures(pressure, said)
    temperature = state = None
    if "temperature_C" in columns:
        _check_temperatures(columns["temperature_C"], said)
        temperature = columns["temperature_C"] + ZERO_CELSIUS
    if "state" in columns:
        _check_states(columns["state"], said)
        state = columns["state"].astype(np.uint8)
    return Profile(dx, float(x[0]), pressure, temperature, state)


def _read_map(path: Path, option: str) -> Array:
    """A table of numbers (ny, nx): .npy, or text with commas, semicolons or blanks."""
    check_regular(path, f"the map of {option}")
    try:
        if path.suffix.lower() == ".npy":
            values = np.load(path, allow_pickle=False)
        else:
            text = read_text(path, f"the map of {option}")
            values = np.array(
                [_cells(line) for line in text.splitlines() if line.strip()], dtype=float
            )
        values = np.asarray(values, dtype=float)
    except (EOFError, OSError, TypeError, ValueError, BadZipFile):
        raise SceneError(
            f"{option} {path} is no table of numbers; allowed: .npy, or text with as many numbers "
            "in every row, between commas, semicolons or blanks, and with decimal points"
        ) from None
    if values.ndim != 2 or min(values.shape) < 1 or values.shape[1] < 2 or values.size > LARGEST:
        raise SceneError(
            f"{option} {path} has the shape {values.shape}; allowed: rows and columns, at "
            f"least 1 x 2 and at most {LARGEST:.0e} values"
        )
    if np.isinf(values).any():
        raise SceneError(f"{option} {path} has a value that is infinite")
    return values


def _cells(line: str) -> list[str]:
    """Cells of a row; one separator, which may follow the last of them, too."""
    separator = next((mark for mark in ";," if mark in line), None)
    cells = line.split(separator)
    return cells[:-1] if separator and not cells[-1].strip() else cells


def _check_pressures(values: Array, said: str) -> None:
    low, high = float(values.min()), float(values.max())
    if low < 0.0 or high > HIGHEST:
        raise SceneError(
            f"{said} has pressures from {low:.4g} to {high:.4g} Pa; allowed: 0 to {HIGHEST:.0e} Pa"
        )
    if not high > 0.0:
        raise SceneError(f"{said}: no pressure is above 0, nothing is in contact")


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
    allowed = [int(state) for state in State]
    if not np.isin(values, allowed).all():
        raise SceneError(
            f"{said} has other states than 0 (no contact), 1 (dry), 2 (mixed) and 3 (wet)"
        )
