"""Amplitudes of strain in a DMA table: moduli of filled rubber depend on them."""

from __future__ import annotations

from collections.abc import Sequence

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
