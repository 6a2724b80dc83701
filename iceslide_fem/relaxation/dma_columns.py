"""Columns of a DMA table, by the names that instruments and programs give them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from iceslide_fem.runtime.tables.cells import TextTable
from iceslide_fem.runtime.tables.columns import Wanted, places

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
