"""Dynamic mechanical analysis (DMA): a table of moduli over frequency and temperature.

A table of relaxation moduli over time and temperature is read, too.
"""

from __future__ import annotations

from collections.abc import Sequence
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
SAME_FREQUENCY = 0.01  # relative difference of a row's frequencies in Hz and in rad/s
# Amplitudes of strain: largest ratio within one, and ratio of a table above which it is in doubt.
ONE_STRAIN, STRAINS_IN_DOUBT = 1.25, 3.0
_FREQUENCY = Wanted(
    "frequency", "Hz", ("f", "freq", "f set", "frequenz", "fréquence", "周波数", "频率")
)
_ANGULAR = Wanted(
    "angular_frequency", "rad/s", ("omega", "ω", "w", "angular freq", "kreisfrequenz", "pulsation")
)
_TIME = Wanted("time", "s", ("t", "zeit", "temps"))
_TEMPERATURE = Wanted(
    "temperature",
    "K",
    ("T", "Ts", "temp", "sample temperature", "temperatur", "température", "温度"),
)
_TAN_DELTA = Wanted(
    "tan_delta", "", ("tan d", "tan del", "loss factor", "loss tangent", "damping factor",
                      "verlustfaktor", "facteur de perte"),
)  # fmt: skip
_STRAIN = Wanted(
    "strain", "", ("strain amplitude", "oscillation strain", "shear strain", "dynamic strain",
                   "gamma", "γ", "dehnung", "deformation", "verformung"),
)  # fmt: skip
# Moduli: mark behind E or G, words beside them, names that do not say which of both it is.
_NAMES = (
    (
        "'",
        ("storage", "stor", "speicher"),
        ("speichermodul", "module de conservation", "貯蔵弾性率", "储能模量"),
    ),
    ("''", ("loss", "verlust"), ("verlustmodul", "module de perte", "損失弾性率", "损耗模量")),
    ("(t)", ("relaxation", "relax", "relaxations"), ("relaxationsmodul",)),
    ("*", ("complex",), ()),
)
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
    has = {kind: _has(table, kind) for kind in ("E", "G")}
    kind: Kind = of or ("G" if has["G"] and not has["E"] else "E")
    other: Kind = "G" if kind == "E" else "E"
    if has[other] and not has[kind]:
        table.refuse(f"has moduli {other}, and {kind} was asked for")
    values = _values(table, kind, temperature)
    frequency = values["frequency"]
    if not FEWEST_ROWS <= len(frequency) <= MOST_ROWS:
        table.refuse(f"has {len(frequency)} rows; allowed: {FEWEST_ROWS} to {MOST_ROWS}")
    values["temperature"] = _isotherms(table, values["temperature"])
    kept, doubts = _of_one_strain(table, values, strain)
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
    storage, loss, relaxing, whole = _moduli(kind)
    if not places(table, storage) and places(table, whole) and places(table, _TAN_DELTA):
        storage = whole
    relaxes = bool(places(table, relaxing)) and not places(table, storage)
    has_tan = bool(places(table, _TAN_DELTA)) and not places(table, loss)
    needed = [_TEMPERATURE, storage, _TAN_DELTA if has_tan else loss]
    if relaxes:
        needed = [_TIME, _TEMPERATURE, relaxing]
    if temperature is not None:
        if places(table, _TEMPERATURE):
            table.refuse("has a column of temperatures, and a temperature was given, too")
        needed.remove(_TEMPERATURE)
    frequency = None if relaxes else _angular(table)
    given = find_columns(table, needed, [column.name for column in needed])
    turns = {} if frequency is None else {_FREQUENCY.name: frequency / (2.0 * np.pi)}
    _check_ranges(table, turns | given)
    rows = len(table.lines)
    at = given.get(_TEMPERATURE.name, np.full(rows, np.nan if temperature is None else temperature))
    if frequency is None:
        time = given[_TIME.name]
        return {"frequency": 1.0 / time, "temperature": at, "storage": given[relaxing.name]}
    moduli = given[storage.name]
    tan_delta = given[_TAN_DELTA.name] if has_tan else given[loss.name] / moduli
    _check_ranges(table, {_TAN_DELTA.name: tan_delta})
    if storage is whole:
        moduli = moduli / np.hypot(1.0, tan_delta)
    losses = given.get(loss.name, moduli * tan_delta)
    return {"frequency": frequency, "temperature": at, "storage": moduli, "loss": losses}


def _moduli(kind: Kind) -> tuple[Wanted, ...]:
    """Columns of storage, loss, relaxation and complex modulus in a table of `kind`."""
    return tuple(
        Wanted(f"{words[0]}_modulus", "Pa", (*_of_kind(kind, mark, words), *bare))
        for mark, words, bare in _NAMES
    )


def _of_kind(kind: Kind, mark: str, words: Sequence[str]) -> tuple[str, ...]:
    """Names of a modulus that say its kind: E', E' storage, storage modulus E', ..."""
    symbols = (kind, f"{kind}{mark}")
    prime = {"'": "prime", "''": "double prime"}.get(mark)
    names = [symbols[1], f"|{symbols[1]}|", *([f"{kind} {prime}"] if prime else [])]
    for word in words:
        for symbol in symbols:
            names += [f"{symbol} {word}", f"{word} {symbol}", f"{symbol} {word} modulus"]
            names += [f"{word} modulus {symbol}", f"{word}modul {symbol}"]
    return tuple(names)


def _has(table: TextTable, kind: Kind) -> bool:
    """Whether a heading names a modulus of `kind`."""
    return any(
        places(table, Wanted(f"{kind}{mark}", "Pa", _of_kind(kind, mark, words)))
        for mark, words, _ in _NAMES
    )


def _angular(table: TextTable) -> Array:
    """Angular frequencies (rad/s), from the columns of frequencies.

    Turns and radians have the same dimension, so the heading decides. Two columns have to agree.
    """
    there = [(column, i) for column in (_FREQUENCY, _ANGULAR) for i in places(table, column)]
    if not there:
        find_columns(table, [_FREQUENCY], [_FREQUENCY.name])  # reports that it is missing
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


def _of_one_strain(
    table: TextTable, values: dict[str, Array], strain: float | None
) -> tuple[Array, tuple[str, ...]]:
    """Which rows (rows,) have the asked amplitude of strain, and doubts about amplitudes.

    Refuses a table that has other moduli at the same frequency and temperature for another
    amplitude (Payne effect), and no amplitude was asked for.
    """
    every = np.ones(len(table.lines), dtype=bool)
    index = places(table, _STRAIN)
    if len(index) != 1 or (
        index[0] < len(table.units) and column_unit(table, index[0], "") is None
    ):
        found = np.full(len(every), np.nan)  # none, or an amplitude in another unit than of strain
    else:
        found = find_columns(table, [_STRAIN], ())[_STRAIN.name]
    if not (found > 0.0).all():
        if strain is not None:
            table.refuse("has no column of strain amplitudes, and one was asked for")
        return every, ()
    amplitudes = _apart(found, ONE_STRAIN)
    if strain is not None:
        kept = np.abs(np.log(found / strain)) < np.log(ONE_STRAIN)
        if not kept.any():
            table.refuse(f"has no rows at a strain of {strain:.3%}; allowed: {_listed(amplitudes)}")
        return kept, ()
    at = np.column_stack([np.round(np.log(values["frequency"]), 2), values["temperature"]])
    for place in np.unique(at, axis=0):
        here = found[(at == place).all(axis=1)]
        if here.max() > ONE_STRAIN * here.min():
            table.refuse(
                f"has moduli of several strain amplitudes ({_listed(amplitudes)}) at the same "
                "frequency and temperature, and moduli depend on it; allowed: rows of one "
                "amplitude, as by iceslide rubber --strain"
            )
    if found.max() <= STRAINS_IN_DOUBT * found.min():
        return every, ()
    return every, (
        f"its strain amplitudes go from {found.min():.3%} to {found.max():.3%}, and moduli of "
        "filled rubber depend on them (Payne effect)",
    )


def _apart(values: Array, ratio: float) -> list[float]:
    """Geometric means of groups of positive values whose neighbours differ by `ratio` or more."""
    ordered = np.sort(values)
    groups = np.split(ordered, np.flatnonzero(ordered[1:] > ratio * ordered[:-1]) + 1)
    return [float(np.exp(np.log(group).mean())) for group in groups]


def _listed(amplitudes: Sequence[float]) -> str:
    return ", ".join(f"{100.0 * each:.3g} %" for each in amplitudes)
