"""Fourier series of maps on grids, periodic or continued by mirror images."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn, irfft2, next_fast_len, rfft2

from iceslide_fem.runtime.arrays import Array

Amplitudes = NDArray[np.inexact[Any]]


class Waves:
    """The waves of a grid of `shape` (rows, columns) with pixels of side `pixel` (m).

    A map that is not periodic is continued by its mirror image at every side. It has a cosine
    series (discrete cosine transform of type II). This equals the series of the periodic map of
    twice its sides, without storing the other three quarters.

    q_x, q_y: wave numbers along x and y (rad/m), broadcastable; count: number of waves of the
    complex series per amplitude.
    """

    def __init__(self, shape: tuple[int, int], pixel: float = 1.0, periodic: bool = True) -> None:
        self.shape, self.periodic = shape, periodic
        rows, columns = shape
        if periodic:
            along_y, along_x = np.fft.fftfreq(rows, pixel), np.fft.rfftfreq(columns, pixel)
            twice_y, twice_x = np.ones(rows), np.full(along_x.size, 2.0)
            if columns % 2 == 0:
                twice_x[-1] = 1.0
        else:
            along_y, along_x = (np.arange(n) / (2 * n * pixel) for n in shape)
            twice_y, twice_x = np.full(rows, 2.0), np.full(columns, 2.0)
            twice_y[0] = 1.0
        twice_x[0] = 1.0
        self.q_y, self.q_x = 2.0 * np.pi * along_y[:, None], 2.0 * np.pi * along_x
        self.count = twice_y[:, None] * twice_x

    @property
    def q(self) -> Array:
        """|q| of every amplitude, rad/m."""
        return np.asarray(np.hypot(self.q_y, self.q_x))

    def amplitudes(self, field: Array) -> Amplitudes:
        """Amplitudes of the complex series of a field; the first one is its mean."""
        transform = rfft2 if self.periodic else dctn
        return np.asarray(transform(field, norm="forward"))

    def field(self, amplitudes: Amplitudes) -> Array:
        """The field with these amplitudes, which are overwritten."""
        if self.periodic:
            return np.asarray(irfft2(amplitudes, self.shape, norm="forward", overwrite_x=True))
        return np.asarray(idctn(amplitudes, norm="forward", overwrite_x=True))

    def power(self, field: Array) -> Array:
        """Mean square of every wave of a field; their sum is that of the field."""
        return np.asarray(self.count * np.abs(self.amplitudes(field)) ** 2)

    def filtered(self, factors: Array, field: Array) -> Array:
        """The field with its amplitudes multiplied by `factors`."""
        return self.field(np.asarray(factors * self.amplitudes(field)))

    def resampled(self, field: Array, other: Waves) -> Array:
        """The field on a coarser grid of the same sides, without unresolved waves."""
        amplitudes = self.amplitudes(field)
        rows, columns = other.count.shape
        if self.periodic:
            positive = (rows + 1) // 2
            kept = [amplitudes[:positive], amplitudes[positive - rows :]]
            return other.field(np.concatenate(kept)[:, :columns].copy())
        return other.field(amplitudes[:rows, :columns].copy())


def coarsest(shape: tuple[int, int], fewest: int, square: float) -> tuple[int, int]:
    """The grid of least cost with at least `fewest` pixels along its longer side.

    Its aspect ratio is that of `shape` within a relative difference `square`; without such a grid
    it is `shape` itself.
    """
    ratio = min(shape) / max(shape)
    grids = [(long, max(1, round(ratio * long))) for long in range(fewest, max(shape))]
    alike = [grid for grid in grids if abs(grid[1] / (ratio * grid[0]) - 1.0) <= square]
    long, short = min([*alike, (max(shape), min(shape))], key=_cost)
    return (short, long) if shape[0] < shape[1] else (long, short)


def _cost(grid: tuple[int, int]) -> float:
    """Cost of the transforms, in pixels; large prime factors double it."""
    fast = all(next_fast_len(n) == n for n in grid)
    return grid[0] * grid[1] * (1.0 if fast else 2.0)
