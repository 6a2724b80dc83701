"""Dynamic mechanical analysis (DMA): a table of moduli over frequency and temperature."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import Wanted, column_unit, find_columns, places
from iceslide_fem.runtime.tables.layout import read_table
from iceslide_fem.runtime.units import ZERO_CELSIUS

Kind = Literal["E", "G"]
FEWEST_ROWS, MOST_ROWS = 4, 20_000
# Rows of one isotherm: largest difference of neighbouring temperatures; the whole range is at most
# twice.
ONE_TEMPERATURE = 1.0  # K
_FREQUENCY = Wanted("frequency", "Hz", ("f", "freq", "freq."))
_ANGULAR = Wanted("angular_frequency", "rad/s", ("omega", "ω", "w", "angular freq"))
_TEMPERATURE = Wanted("temperature", "K", ("T", "temp", "temp."))
_TAN_DELTA = Wanted("tan_delta", "", ("tan delta", "tan δ", "tand", "tandelta", "loss_factor"))
# Lowest and highest values, zero of the unit of messages, that unit.
_RANGES = {
    "frequency": (1e-9, 1e12, 0.0, " Hz"),
    "temperature": (123.15, 473.15, ZERO_CELSIUS, " degC"),
    "storage_modulus": (1.0, 1e13, 0.0, " Pa"),
    "loss_modulus": (1e-6, 1e13, 0.0, " Pa"),
    "tan_delta": (1e-6, 1e2, 0.0, ""),
}


@dataclass(frozen=True)
class Dma:
    """Measured moduli; arrays (rows,), sorted by temperature, then frequency.

    of: Young's modulus (E) or shear modulus (G); frequency: rad/s; temperature: of the row's
    isotherm, K; storage, loss: Pa.
    """

    of: Kind
    frequency: Array
    temperature: Array
    storage: Array
    loss: Array

    @property
    def isotherms(self) -> Array:
        """Temperatures of the isotherms (K), ascending."""
        return np.unique(self.temperature)

    @property
    def tan_delta(self) -> Array:
        """Loss over storage modulus."""
        return self.loss / self.storage


def read_dma(path: Path, said: str, of: Kind | None = None) -> Dma:
    """The table at `path`: frequency, temperature, storage modulus, loss modulus or tan delta.

    said: name of the file in messages; of: kind of its moduli, by default from its headings, else
    E. Raises SceneError with the row and the fault.
    """
    table = read_table(path, said).filled()
    named: Kind = "G" if _has(table, "G") and not _has(table, "E") else "E"
    kind: Kind = of or named
    other: Kind = "G" if kind == "E" else "E"
    if _has(table, other):
        table.refuse(f"has moduli {other}, and {kind} was asked for")
    storage, loss = _moduli(kind)
    frequency = _angular(table)
    wanted = (_TEMPERATURE, storage, loss, _TAN_DELTA)
    has_tan = bool(places(table, _TAN_DELTA)) and not places(table, loss)
    needed = [_TEMPERATURE, storage, _TAN_DELTA if has_tan else loss]
    given = find_columns(table, wanted, [column.name for column in needed])
    if not FEWEST_ROWS <= len(frequency) <= MOST_ROWS:
        table.refuse(f"has {len(frequency)} rows; allowed: {FEWEST_ROWS} to {MOST_ROWS}")
    # If both are given, the loss modulus is used.
    losses = given.get(loss.name, given[storage.name] * given.get(_TAN_DELTA.name, 1.0))
    tan_delta = losses / given[storage.name]
    _check_ranges(table, {_FREQUENCY.name: frequency / (2.0 * np.pi), **given})
    _check_ranges(table, {_TAN_DELTA.name: tan_delta})
    temperature = _isotherms(table, given[_TEMPERATURE.name])
    different = len(set(zip(frequency.tolist(), temperature.tolist(), strict=True)))
    if different < FEWEST_ROWS:
        table.refuse(f"has {different} different frequencies; allowed: {FEWEST_ROWS} or more")
    order = np.lexsort((frequency, temperature))
    arrays = (frequency, temperature, given[storage.name], losses)
    return Dma(kind, *(values[order] for values in arrays))


def _moduli(kind: Kind) -> tuple[Wanted, Wanted]:
    """Columns of storage and loss modulus with the names in a table of `kind`."""
    marks = (("'", "\N{PRIME}", "_prime"), ("''", "\N{DOUBLE PRIME}", "_double_prime"))
    words = ("storage", "loss")
    storage, loss = (
        Wanted(
            f"{word}_modulus",
            "Pa",
            tuple(f"{kind}{mark}" for mark in some)
            + tuple(f"{word}_modulus_{kind}{mark}" for mark in ("", *some))
            + (f"{kind}_{word}", f"{word}_{kind}", f"{kind}_{word}_modulus"),
        )
        for word, some in zip(words, marks, strict=True)
    )
    return storage, loss


def _has(table: TextTable, kind: Kind) -> bool:
    """Whether a heading names a modulus of `kind`."""
    named = (Wanted(column.other[0], "Pa", column.other[1:]) for column in _moduli(kind))
    return any(places(table, column) for column in named)


def _angular(table: TextTable) -> Array:
    """Angular frequencies (rad/s), from the column of frequencies.

    Turns and radians have the same dimension, so the heading decides.
    """
    there = [(column, i) for column in (_FREQUENCY, _ANGULAR) for i in places(table, column)]
    if len(there) > 1:
        table.refuse("has more than one column of frequencies; one of them is needed")
    if not there:
        find_columns(table, [_FREQUENCY], [_FREQUENCY.name])  # reports that it is missing
    column, index = there[0]
    values = find_columns(table, [column], ())[column.name]
    unit = column_unit(table, index, column.unit) or ""
    if "rad" not in unit and not unit.lower().endswith("hz"):
        table.refuse(
            f"column {index + 1} ({table.heading[index]}) is in {unit or 'no unit'}, which may "
            "count turns or radians; allowed: Hz, rad/s"
        )
    if column is _ANGULAR and "rad" not in unit:
        table.refuse(
            f"column {index + 1} ({table.heading[index]}) is an angular frequency in {unit}; "
            "allowed: rad/s, or a frequency in Hz"
        )
    return values if "rad" in unit else 2.0 * np.pi * values


def _check_ranges(table: TextTable, columns: dict[str, Array]) -> None:
    """Refuse the first row with a missing value or a value out of range."""
    for name, values in columns.items():
        low, high, zero, unit = _RANGES[name]
        for row in np.flatnonzero(~((values >= low) & (values <= high)))[:1]:
            value = values[row]
            said = "is missing" if np.isnan(value) else f"= {value - zero:g}{unit} is out of range"
            table.refuse(
                f"row {row + 1} (line {table.lines[row].number}): {name} {said}; allowed: "
                f"{low - zero:g} to {high - zero:g}{unit}"
            )


def _isotherms(table: TextTable, temperature: Array) -> Array:
    """Temperature (K) of each row's isotherm: the mean over its rows."""
    order = np.argsort(temperature, kind="stable")
    starts = np.flatnonzero(np.diff(temperature[order]) > ONE_TEMPERATURE) + 1
    result = np.empty_like(temperature)
    for rows in np.split(order, starts):
        low, high = temperature[rows].min(), temperature[rows].max()
        if high - low > 2.0 * ONE_TEMPERATURE:
            table.refuse(
                f"its temperatures go from {low - ZERO_CELSIUS:.4g} to {high - ZERO_CELSIUS:.4g} "
                f"degC in steps below {ONE_TEMPERATURE:g} K; needed: frequencies at each of a few "
                "temperatures (isotherms), further apart"
            )
        result[rows] = round(float(temperature[rows].mean()), 2)
    return result
