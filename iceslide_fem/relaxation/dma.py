"""Dynamic mechanical analysis (DMA): a table of moduli over frequency and temperature.

A table of relaxation moduli over time and temperature is read, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iceslide_fem.relaxation.dma_columns import (
    ANGULAR,
    FREQUENCY,
    TAN_DELTA,
    TEMPERATURE,
    TIME,
    Kind,
    moduli_columns,
    names_kind,
    of_one_strain,
)
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import (
    Wanted,
    check_range,
    column_unit,
    find_columns,
    places,
)
from iceslide_fem.runtime.tables.layout import read_table
from iceslide_fem.runtime.units import ZERO_CELSIUS

FEWEST_ROWS, MOST_ROWS = 4, 20_000
# Rows of one isotherm: largest difference of neighbouring temperatures; the whole range is at most
# twice.
ONE_TEMPERATURE = 1.0  # K
SAME_FREQUENCY = 0.01  # relative difference of a row's frequencies in Hz and in rad/s
# Lowest and highest values, zero of the unit of messages, that unit.
_RANGES = {
    "frequency": (1e-15, 1e13, 0.0, " Hz"),
    "time": (1e-14, 1e15, 0.0, " s"),
    "temperature": (123.15, 473.15, ZERO_CELSIUS, " degC"),
    "storage_modulus": (1.0, 1e13, 0.0, " Pa"),
    "loss_modulus": (1e-6, 1e13, 0.0, " Pa"),
    "relaxation_modulus": (1.0, 1e13, 0.0, " Pa"),
    "complex_modulus": (1.0, 1e13, 0.0, " Pa"),
    "tan_delta": (1e-6, 1e2, 0.0, ""),
}


@dataclass(frozen=True)
class Dma:
    """Measured moduli; arrays (rows,), sorted by temperature, then frequency.

    of: Young's modulus (E) or shear modulus (G); frequency: rad/s; temperature: of the row's
    isotherm, K; storage, loss: Pa. In a table of relaxation there is no loss: storage is the
    modulus at the time 1 / frequency. named: whether headings say what `of` is; doubts: about the
    table, without full stop.
    """

    of: Kind
    frequency: Array
    temperature: Array
    storage: Array
    loss: Array | None
    named: bool = True
    doubts: tuple[str, ...] = ()

    @property
    def isotherms(self) -> Array:
        """Temperatures of the isotherms (K), ascending."""
        return np.unique(self.temperature)

    @property
    def tan_delta(self) -> Array | None:
        """Loss over storage modulus; None of relaxation."""
        return None if self.loss is None else self.loss / self.storage


def read_dma(
    path: Path,
    said: str,
    of: Kind | None = None,
    strain: float | None = None,
    temperature: float | None = None,
) -> Dma:
    """The table at `path`: frequency, temperature, storage modulus, loss modulus or tan delta.

    Or time, temperature and relaxation modulus. said: name of the file in messages; of: kind of its
    moduli, by default from its headings, else E; strain: amplitude of the rows to take, by default
    all; temperature: of a table without such a column, K. Raises SceneError with the row and the
    fault.
    """
    table = read_table(path, said).filled()
    has = {kind: names_kind(table, kind) for kind in ("E", "G")}
    kind: Kind = of or ("G" if has["G"] and not has["E"] else "E")
    other: Kind = "G" if kind == "E" else "E"
    if has[other] and not has[kind]:
        table.refuse(f"has moduli {other}, and {kind} was asked for")
    values = _values(table, kind, temperature)
    frequency = values["frequency"]
    if not FEWEST_ROWS <= len(frequency) <= MOST_ROWS:
        table.refuse(f"has {len(frequency)} rows; allowed: {FEWEST_ROWS} to {MOST_ROWS}")
    values["temperature"] = _isotherms(table, values["temperature"])
    kept, doubts = of_one_strain(table, values, strain)
    values = {name: value[kept] for name, value in values.items()}
    pairs = zip(values["frequency"].tolist(), values["temperature"].tolist(), strict=True)
    if (different := len(set(pairs))) < FEWEST_ROWS:
        table.refuse(f"has {different} different frequencies; allowed: {FEWEST_ROWS} or more")
    order = np.lexsort((values["frequency"], values["temperature"]))
    values = {name: value[order] for name, value in values.items()}
    return Dma(
        kind, values["frequency"], values["temperature"], values["storage"], values.get("loss"),
        has[kind], doubts,
    )  # fmt: skip


def _values(table: TextTable, kind: Kind, temperature: float | None) -> dict[str, Array]:
    """Angular frequency, temperature, storage and, but for relaxation, loss; each checked."""
    storage, loss, relaxing, whole = moduli_columns(kind)
    if not places(table, storage) and places(table, whole) and places(table, TAN_DELTA):
        storage = whole
    relaxes = bool(places(table, relaxing)) and not places(table, storage)
    has_tan = bool(places(table, TAN_DELTA)) and not places(table, loss)
    needed = [TEMPERATURE, storage, TAN_DELTA if has_tan else loss]
    if relaxes:
        needed = [TIME, TEMPERATURE, relaxing]
    if temperature is not None:
        if places(table, TEMPERATURE):
            table.refuse("has a column of temperatures, and a temperature was given, too")
        needed.remove(TEMPERATURE)
    frequency = None if relaxes else _angular(table)
    given = find_columns(table, needed, [column.name for column in needed])
    turns = {} if frequency is None else {FREQUENCY.name: frequency / (2.0 * np.pi)}
    for name, values in (turns | given).items():
        check_range(table, name, values, *_RANGES[name])
    rows = len(table.lines)
    at = given.get(TEMPERATURE.name, np.full(rows, np.nan if temperature is None else temperature))
    if frequency is None:
        time = given[TIME.name]
        return {"frequency": 1.0 / time, "temperature": at, "storage": given[relaxing.name]}
    moduli = given[storage.name]
    tan_delta = given[TAN_DELTA.name] if has_tan else given[loss.name] / moduli
    check_range(table, TAN_DELTA.name, tan_delta, *_RANGES[TAN_DELTA.name])
    if storage is whole:
        moduli = moduli / np.hypot(1.0, tan_delta)
    losses = given.get(loss.name, moduli * tan_delta)
    return {"frequency": frequency, "temperature": at, "storage": moduli, "loss": losses}


def _angular(table: TextTable) -> Array:
    """Angular frequencies (rad/s), from the columns of frequencies.

    Turns and radians have the same dimension, so the heading decides. Two columns have to agree.
    """
    there = [(column, i) for column in (FREQUENCY, ANGULAR) for i in places(table, column)]
    if not there:
        find_columns(table, [FREQUENCY], [FREQUENCY.name])  # reports that it is missing
    found = [_in_radians(table, *each) for each in there]
    for further in found[1:]:
        apart = np.abs(further - found[0]) > SAME_FREQUENCY * np.abs(found[0])
        for row in np.flatnonzero(apart)[:1]:
            table.refuse(
                f"row {row + 1} (line {table.lines[row].number}): its frequencies, "
                f"{found[0][row]:.4g} and {further[row]:.4g} rad/s, differ; allowed: columns that "
                "agree, or one of them"
            )
    return found[0]


def _in_radians(table: TextTable, column: Wanted, index: int) -> Array:
    values = find_columns(table, [column], ())[column.name]
    unit = column_unit(table, index, column.unit) or ""
    if "rad" not in unit and not unit.lower().endswith("hz"):
        table.refuse(
            f"column {index + 1} ({table.heading[index]}) is in {unit or 'no unit'}, which may "
            "count turns or radians; allowed: Hz, rad/s"
        )
    if column is ANGULAR and "rad" not in unit:
        table.refuse(
            f"column {index + 1} ({table.heading[index]}) is an angular frequency in {unit}; "
            "allowed: rad/s, or a frequency in Hz"
        )
    return values if "rad" in unit else 2.0 * np.pi * values


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
