"""Columns of a DMA table, by the names that instruments and programs give them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import Wanted, column_unit, find_columns, places

# Largest ratio within an amplitude, and ratio of a table above which it is in doubt.
ONE_STRAIN, STRAINS_IN_DOUBT = 1.25, 3.0
_STRAIN = Wanted(
    "strain", "", ("strain amplitude", "oscillation strain", "shear strain", "dynamic strain",
                   "gamma", "γ", "dehnung", "deformation", "verformung"),
)  # fmt: skip


def of_one_strain(
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
    place = np.unique(at, axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((found, place))
    same, ratios = np.diff(place[order]) == 0, found[order][1:] / found[order][:-1]
    if (ratios[same] > ONE_STRAIN).any():
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


Kind = Literal["E", "G"]
FREQUENCY = Wanted(
    "frequency", "Hz", ("f", "freq", "f set", "frequenz", "fréquence", "周波数", "频率")
)
ANGULAR = Wanted(
    "angular_frequency", "rad/s", ("omega", "ω", "w", "angular freq", "kreisfrequenz", "pulsation")
)
TIME = Wanted("time", "s", ("t", "zeit", "temps"))
TEMPERATURE = Wanted(
    "temperature",
    "K",
    ("T", "Ts", "temp", "sample temperature", "temperatur", "température", "温度"),
)
TAN_DELTA = Wanted(
    "tan_delta", "", ("tan d", "tan del", "loss factor", "loss tangent", "damping factor",
                      "verlustfaktor", "facteur de perte"),
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


def moduli_columns(kind: Kind) -> tuple[Wanted, ...]:
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


def names_kind(table: TextTable, kind: Kind) -> bool:
    """Whether a heading names a modulus of `kind`."""
    return any(
        places(table, Wanted(f"{kind}{mark}", "Pa", _of_kind(kind, mark, words)))
        for mark, words, _ in _NAMES
    )
