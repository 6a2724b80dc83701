"""Shear strength tau_b of dry rubber on ice over the ice's surface temperature.

A number tau_0 gives tau_0 min(1, (T_m + delta - T) / Delta); otherwise it is a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene import Scene

# Slip speed (m/s) below which dry shear falls linearly to 0, at the strength of this speed.
SLOWEST = 1e-6
DRY = ("dry_stress", "dry_softening", "dry_residual")


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

    def at_depths(self, depths: Array) -> Array:
        """tau_b (Pa) at several u (K) of each point, (m, n)."""
        tau = np.broadcast_to(self.strength[0], depths.shape)
        for row in range(len(self.depth) - 1):
            run, rise = (np.diff(part[row : row + 2], axis=0)[0] for part in self[:2])
            share = np.divide(depths - self.depth[row], run, where=run > 0.0, out=0.0 * depths)
            tau = tau + rise * np.clip(share, 0.0, 1.0)
        return tau

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

    @property
    def softest(self) -> Array:
        """tau_b at the melting point, Pa."""
        return self.strength[0]

    @property
    def hardest(self) -> Array:
        """The largest tau_b, Pa."""
        return self.strength[-1]

    def slope_at(self, depth: Array) -> Array:
        """d tau_b / d u (Pa/K) above each u (K), (n,)."""
        return self.segment(depth)[1]

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


def shear_strength(scene: Scene, **varied: Any) -> ShearStrength | None:
    """tau_b of dry rubber on the ice of a scene; None without a limit of the shear.

    varied: values in place of the film's keys `DRY`.
    """
    stress, softening, residual = (varied.get(key, getattr(scene.film, key)) for key in DRY)
    if stress is None:
        return None
    if isinstance(stress, tuple):
        return ShearStrength.of_rows(stress, scene.ice.melting_temperature)
    return ShearStrength.softening(stress, np.inf if softening is None else softening, residual)
