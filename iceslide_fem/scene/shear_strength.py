"""Shear strength tau_b of dry rubber on ice over the ice's surface temperature.

A number tau_0 gives tau_0 min(1, (T_m + delta - T) / Delta); otherwise it is a table.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene.rows import Rows, RowsOf
from iceslide_fem.scene.units import Quantity


class ShearStrength(NamedTuple):
    """tau_b (Pa) over the temperature below the melting point, u = T_m - T (K).

    depth: ascending u from 0; strength: tau_b there, not falling with u; both (rows, 1), or (rows,
    n) if points differ. Linear between rows, constant beyond the last.
    """

    depth: Array
    strength: Array

    @classmethod
    def softening(
        cls, stress: ArrayLike, softening: ArrayLike, residual: ArrayLike
    ) -> ShearStrength:
        """tau_0 min(1, (T_m + delta - T) / Delta), of numbers or of arrays (n,).

        stress: tau_0 (Pa); softening: Delta (K), infinite where it does not soften; residual:
        delta (K).
        """
        given = np.broadcast_arrays(*map(np.atleast_1d, (stress, softening, residual)))
        highest, over, above = (np.asarray(part, dtype=float) for part in given)
        softens = (above < over) & np.isfinite(over)
        if not softens.any():
            return cls(np.zeros((1, highest.size)), highest[None].copy())
        rows = (
            np.where(softens, over - above, 1.0),
            np.where(softens, highest * above / over, highest),
        )
        return cls(np.stack([np.zeros_like(over), rows[0]]), np.stack([rows[1], highest]))

    @classmethod
    def of_rows(cls, rows: tuple[tuple[float, float], ...], melting: float) -> ShearStrength:
        """tau_b of rows [T (K), tau_b (Pa)] in ascending T, for ice that melts at `melting` (K)."""
        kelvin, strength = np.array(rows).T
        depth = melting - kelvin[::-1]
        below = depth > 0.0
        at_melting = np.interp(0.0, depth, strength[::-1])
        columns = (np.append(0.0, depth[below]), np.append(at_melting, strength[::-1][below]))
        return cls(*(column[:, None] for column in columns))

    def __call__(self, depth: Array) -> Array:
        """tau_b (Pa) at u (K), (n,)."""
        row, slope = self.segment(depth)
        return self.at(row, self.strength) + slope * (depth - self.at(row, self.depth))

    def segment(self, depth: Array) -> tuple[Index, Array]:
        """The row below each u (K), (n,), and d tau_b / d u (Pa/K) above it."""
        row = (depth >= self.depth).sum(axis=0) - 1
        return np.maximum(row, 0), self.slope(row)

    def slope(self, row: Index) -> Array:
        """d tau_b / d u (Pa/K) from each of these rows to the next, 0 beyond the ends."""
        last = len(self.depth) - 1
        here, there = np.clip(row, 0, last), np.clip(row + 1, 0, last)
        rise = self.at(there, self.strength) - self.at(here, self.strength)
        run = self.at(there, self.depth) - self.at(here, self.depth)
        return np.divide(rise, run, out=np.zeros_like(rise), where=run > 0.0)

    def at(self, row: Index, column: Array) -> Array:
        """Values of a column in these rows, (n,)."""
        if column.shape[1] == 1:
            return column[row, 0]
        return np.take_along_axis(column, row[None], axis=0)[0]

    @classmethod
    def together(cls, strengths: Sequence[ShearStrength], sizes: Sequence[int]) -> ShearStrength:
        """One strength for the points of several (`sizes` each), which have equally many rows."""
        columns = (
            np.hstack(
                [
                    np.broadcast_to(column, (len(column), n))
                    for column, n in zip(columns, sizes, strict=True)
                ]
            )
            for columns in zip(*strengths, strict=True)
        )
        return cls(*columns)

    def take(self, index: Index) -> ShearStrength:
        """The same at the points of `index`."""
        if self.depth.shape[1] == 1:
            return self
        return ShearStrength(*(column.take(index, axis=1, mode="clip") for column in self))


DRY_STRESS = RowsOf(
    "ice temperature",
    Quantity("K", "-80 degC", "0.01 degC"),
    Quantity("Pa", "1 Pa", "1 GPa"),
    "0 Pa",
)
SOFTENING = Quantity("K", "0.01 K", "200 K")
RESIDUAL = Quantity("K", "0 K", "200 K")
USUAL_RESIDUAL = 0.5  # K
THINNEST = 1e-9  # m, initial height of water films


class DryShear(NamedTuple):
    """Input data of dry rubber on ice: keys of a scene's film, or options of a command.

    stress: tau_b (Pa), a number or rows [T (K), tau_b], None without a limit of the film's shear;
    softening, residual: fall of a number with temperature, K.
    """

    stress: float | Rows | None = None
    softening: float | None = None
    residual: float = USUAL_RESIDUAL

    @property
    def softens(self) -> bool:
        """Whether the stress depends on temperature."""
        if isinstance(self.stress, tuple):
            return self.stress[-1][1] < self.stress[0][1]
        return self.softening is not None and self.residual < self.softening

    def strength(self, melting: float) -> ShearStrength | None:
        """tau_b on ice that melts at `melting` (K); None without a limit."""
        if self.stress is None:
            return None
        if isinstance(self.stress, tuple):
            return ShearStrength.of_rows(self.stress, melting)
        softening = np.inf if self.softening is None else self.softening
        return ShearStrength.softening(self.stress, softening, self.residual)

    def check(self, thinnest: float, named: Callable[[str], str]) -> None:
        """Raise ValueError if these contradict each other or the initial film.

        thinnest: its least height, m; named: function from keys to names that a user types.
        """
        rows, stress = isinstance(self.stress, tuple), named("dry_stress")
        given = self.softening is not None, self.residual != USUAL_RESIDUAL
        for key, is_given in zip(("dry_softening", "dry_residual"), given, strict=True):
            if is_given and (rows or self.stress is None):
                reason = f"rows of {stress}" if rows else f"no {stress}"
                raise ValueError(
                    f"{named(key)} and {reason} contradict each other: it says how a number of "
                    f"dry_stress falls; allowed: {stress} as a number"
                )
        if isinstance(self.stress, tuple):
            check_softens(self.stress, stress)
        if thinnest < THINNEST and self.stress is None:
            raise ValueError(
                f"{named('initial_height')} = {readable(thinnest, 'm')} is out of range; allowed: "
                f"1 nm to 10 um, or from 0 on with {stress}, which limits the shear of thin films"
            )


def check_softens(rows: Rows, key: str) -> None:
    """Raise ValueError with `key` if the strength rises with temperature."""
    for number, (colder, warmer) in enumerate(pairwise(rows), start=1):
        if warmer[1] > colder[1]:
            raise ValueError(
                f"{key} rises from row {number} to row {number + 1}: ice gets softer as it gets "
                "warmer; allowed: stresses that fall, or stay as they are"
            )
    if rows[0][1] == 0.0:
        raise ValueError(f"{key} is 0 in all rows; allowed: more than 0 where ice is coldest")
