"""A height map of rubber: what is done to a measured one, and the figures that describe it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.errors import SceneError

MISSING_AT_MOST = 0.1  # share of the map
FEWEST_PIXELS = 16  # along either side


@dataclass(frozen=True)
class Surface:
    """Heights (m) on square pixels, rows along y, asperities up: away from the rubber.

    pixel: m. A periodic surface continues at its opposite side. measured: the longest distance of
    measured heights, m, where it is more than a pixel. notes: what a person should know of the file
    that it is from, sentences.
    """

    heights: Array
    pixel: float
    periodic: bool
    measured: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def resolution(self) -> float:
        """The distance of heights that no wave may have too few of, m."""
        return max(self.pixel, self.measured)

    @property
    def size(self) -> tuple[float, float]:
        """Lengths along x and y, m."""
        rows, columns = self.heights.shape
        return columns * self.pixel, rows * self.pixel


class Statistics(NamedTuple):
    """rms height (m), rms slope (of the gradient's length) and skewness of a periodic surface."""

    rms_height: float
    rms_slope: float
    skewness: float


class Spectrum(NamedTuple):
    """Power spectrum of heights over the wave number |q|, mean over directions.

    q: rad/m; density: m^4, so that the mean square height is its integral over q dq / (2 pi).
    """

    q: Array
    density: Array


class SpectrumFit(NamedTuple):
    """A plateau up to `rolloff` (m), and q^(-2 (1 + hurst)) for shorter waves."""

    hurst: float
    rolloff: float


def levelled(surface: Surface) -> Surface:
    """Without tilt, with missing heights (NaN) filled, and mirrored so that it is periodic.

    Tilt is the plane of least squares; missing heights satisfy Laplace's equation. A map that is
    wrapped without being mirrored has a cliff along its sides, which holds it off the ice.
    Raises SceneError if more than a tenth is missing or the map is flat or too small.
    """
    z = surface.heights
    if min(z.shape) < FEWEST_PIXELS:
        raise SceneError(
            f"the map has {z.shape[1]} x {z.shape[0]} pixels; "
            f"allowed: {FEWEST_PIXELS} or more along either side"
        )
    missing = ~np.isfinite(z)
    share = float(missing.mean())
    if share > MISSING_AT_MOST:
        raise SceneError(
            f"{share:.1%} of the map's heights are missing; allowed: up to {MISSING_AT_MOST:.0%}"
        )
    y, x = np.indices(z.shape, dtype=float)
    plane = np.column_stack([x.ravel(), y.ravel(), np.ones(z.size)])
    there = ~missing.ravel()
    tilt, *_ = np.linalg.lstsq(plane[there], z.ravel()[there], rcond=None)
    z = z - (plane @ tilt).reshape(z.shape)
    if missing.any():
        z = _filled(z, missing)
    if float(z.std()) < 1e-12:
        raise SceneError("the map is flat: all of its heights lie in one plane")
    if not surface.periodic:
        z = np.block([[z, z[:, ::-1]], [z[::-1], z[::-1, ::-1]]])
    return replace(surface, heights=z, periodic=True)


def _filled(z: Array, missing: Mask) -> Array:
    """`z` with missing heights that are the mean of their neighbours."""
    number = np.full(z.shape, -1)
    number[missing] = np.arange(np.count_nonzero(missing))
    rows, columns = np.nonzero(missing)
    diagonal, known = np.zeros(rows.size), np.zeros(rows.size)
    pairs = []
    for down, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        i, j = rows + down, columns + right
        within = np.flatnonzero((0 <= i) & (i < z.shape[0]) & (0 <= j) & (j < z.shape[1]))
        i, j = i[within], j[within]
        diagonal[within] += 1.0
        other = number[i, j]
        known[within] += np.where(other < 0, np.nan_to_num(z[i, j]), 0.0)
        pairs.append(np.stack([within[other >= 0], other[other >= 0]]))
    here, there = np.concatenate(pairs, axis=1)
    links = coo_matrix((np.ones(here.size), (here, there)), shape=(rows.size, rows.size))
    result = z.copy()
    result[missing] = spsolve((diags(diagonal) - links).tocsc(), known)
    return result


def low_passed(surface: Surface, shortest_wave: float) -> Surface:
    """A periodic surface without waves shorter than `shortest_wave` (m)."""
    q = wave_numbers(surface.heights.shape, surface.pixel)
    spectrum = np.fft.rfft2(surface.heights)
    spectrum[q > 2.0 * np.pi / shortest_wave * (1.0 + 1e-9)] = 0.0
    return replace(surface, heights=np.fft.irfft2(spectrum, s=surface.heights.shape))


def wave_numbers(shape: tuple[int, ...], pixel: float) -> Array:
    """|q| (rad/m) of the waves that `rfft2` gives."""
    along_y, along_x = np.fft.fftfreq(shape[0], pixel), np.fft.rfftfreq(shape[1], pixel)
    return np.asarray(2.0 * np.pi * np.hypot(along_y[:, None], along_x))


def statistics(surface: Surface) -> Statistics:
    """Figures of a periodic surface; slopes are those of its Fourier series."""
    z = surface.heights - surface.heights.mean()
    power = _wave_power(z)
    q = wave_numbers(z.shape, surface.pixel)
    rms = float(np.sqrt(np.mean(z**2)))
    slope = float(np.sqrt((q**2 * power).sum()))
    return Statistics(rms, slope, float(np.mean(z**3)) / rms**3)


def _wave_power(z: Array) -> Array:
    """Mean square height of every wave that `rfft2` gives; their sum is that of the surface."""
    power = np.abs(np.fft.rfft2(z) / z.size) ** 2
    power[:, 1 : (z.shape[1] + 1) // 2] *= 2.0  # the waves with negative q_x
    return np.asarray(power)


def spectrum(surface: Surface) -> Spectrum:
    """Spectrum of a periodic surface, averaged over rings one lowest wave number wide."""
    z = surface.heights - surface.heights.mean()
    power = _wave_power(z)
    q = wave_numbers(z.shape, surface.pixel)
    lowest = 2.0 * np.pi / max(surface.size)
    ring = np.rint(q / lowest).astype(int).ravel()
    shortest = np.pi / surface.pixel
    bins = np.arange(1, int(shortest / lowest) + 1)
    number = np.where(q.ravel() <= shortest, ring, 0)
    total = np.bincount(number, power.ravel(), minlength=bins.size + 2)[bins]
    weight = np.ones_like(q)
    weight[:, 1 : (z.shape[1] + 1) // 2] = 2.0
    count = np.bincount(number, weight.ravel(), minlength=bins.size + 2)[bins]
    full = count > 0
    area = surface.size[0] * surface.size[1]
    return Spectrum((lowest * bins[full]).astype(float), area * total[full] / count[full])


def spectrum_fit(found: Spectrum, shortest_wave: float) -> SpectrumFit | None:
    """Least squares of the logarithms over waves down to `shortest_wave` (m); None if too few."""
    use = (found.q <= 2.0 * np.pi / shortest_wave) & (found.density > 0.0)
    if np.count_nonzero(use) < 6:
        return None
    x, y = np.log(found.q[use]), np.log(found.density[use])
    weight = np.sqrt(found.q[use] / found.q[use].max())  # rings with more waves scatter less

    def residual(values: Array) -> Array:
        level, knee, hurst = values
        return np.asarray(weight * (y - level + 2.0 * (1.0 + hurst) * np.maximum(x - knee, 0.0)))

    low, high = [-np.inf, x[0], -1.0], [np.inf, x[-1], 3.0]
    starts = [x[0] + share * (x[-1] - x[0]) for share in (0.2, 0.4, 0.6)]
    fits = [least_squares(residual, [y[0], knee, 0.5], bounds=(low, high)) for knee in starts]
    best = min(fits, key=lambda fit: fit.cost)
    return SpectrumFit(float(best.x[2]), float(2.0 * np.pi / np.exp(best.x[1])))
