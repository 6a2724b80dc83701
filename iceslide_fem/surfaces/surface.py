"""A height map of rubber: processing, and statistical figures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.surfaces.height_map import SQUARE
from iceslide_fem.surfaces.waves import Waves, coarsest

MISSING_AT_MOST, NOTED = 0.1, 0.01  # fractions of the map
FEWEST_PIXELS = 16  # along either side


@dataclass(frozen=True)
class Surface:
    """Heights (m) on square pixels, rows along y, asperities up: away from the rubber.

    pixel: m; periodic: else it is continued by its mirror image at every side; measured: largest
    distance of measured heights, m, if it exceeds a pixel; notes: sentences on its file for the
    user.
    """

    heights: Array
    pixel: float
    periodic: bool
    measured: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def resolution(self) -> float:
        """The distance of measured heights, which limits the shortest wave, m."""
        return max(self.pixel, self.measured)

    @property
    def size(self) -> tuple[float, float]:
        """Lengths along x and y, m."""
        rows, columns = self.heights.shape
        return columns * self.pixel, rows * self.pixel

    @property
    def waves(self) -> Waves:
        """Its Fourier series."""
        shape = self.heights.shape[0], self.heights.shape[1]
        return Waves(shape, self.pixel, self.periodic)


class Statistics(NamedTuple):
    """rms height (m), rms slope (of the gradient's length) and skewness of a surface."""

    rms_height: float
    rms_slope: float
    skewness: float


class Spectrum(NamedTuple):
    """Power spectrum of heights over the wave number |q|, averaged over directions.

    q: rad/m; density: m^4. The mean square height is its integral over q dq / (2 pi).
    """

    q: Array
    density: Array


class SpectrumFit(NamedTuple):
    """A plateau up to `rolloff` (m), and q^(-2 (1 + hurst)) for shorter waves."""

    hurst: float
    rolloff: float


def levelled(surface: Surface) -> Surface:
    """The surface without tilt, and with missing heights (NaN) filled.

    The tilt is the least-squares plane; missing heights satisfy Laplace's equation. Raises
    SceneError if more than a tenth is missing or the map is flat or too small.
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
    z = z - _plane(z, missing)
    if missing.any():
        z = _filled(z, missing)
    if float(z.std()) < 1e-12:
        raise SceneError("the map is flat: all of its heights lie in one plane")
    notes = surface.notes
    if share >= NOTED:
        notes += (
            f"{share:.1%} of its heights are missing and filled: with 9 % missing in patches k was "
            '13 % and D 9 % too large at 1 bar (page "Contact parameters from a rough surface")',
        )
    return replace(surface, heights=z, notes=notes)


def _plane(z: Array, missing: Mask) -> Array:
    """The least-squares plane through the heights that are not missing."""
    there = ~missing
    y, x = (np.linspace(-1.0, 1.0, n) for n in z.shape)
    middle = float(np.mean(z, where=there))
    heights = np.where(there, z - middle, 0.0)
    in_row, in_column = there.sum(axis=1), there.sum(axis=0)
    xx, yy, xy = in_column @ x**2, in_row @ y**2, y @ (there @ x)
    x1, y1 = in_column @ x, in_row @ y
    normal = np.array([[xx, xy, x1], [xy, yy, y1], [x1, y1, in_row.sum()]])
    moments = np.array([x @ heights.sum(axis=0), y @ heights.sum(axis=1), heights.sum()])
    along_x, along_y, level = np.linalg.solve(normal, moments)
    return np.asarray(along_y * y[:, None] + (along_x * x + (level + middle)))


def _filled(z: Array, missing: Mask) -> Array:
    """`z` with missing heights equal to the mean of their neighbours."""
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
    """A surface without waves shorter than `shortest_wave` (m)."""
    waves = surface.waves
    kept = waves.q <= 2.0 * np.pi / shortest_wave * (1.0 + 1e-9)
    return replace(surface, heights=waves.filtered(kept.astype(float), surface.heights))


def coarsened(surface: Surface, pixel: float) -> Surface:
    """The surface on the coarsest grid of its sides whose pixels are no longer than `pixel` (m).

    The Fourier series is truncated to the new grid; without shorter waves the surface is unchanged.
    If the numbers of pixels have no common divisor, the ratio of the sides changes by 0.1 %.
    """
    if pixel <= surface.pixel:
        return surface
    fewest = int(np.ceil(max(surface.size) / pixel * (1.0 - 1e-9)))
    shape = coarsest(surface.waves.shape, fewest, SQUARE)
    pixel = surface.size[0] / shape[1]
    coarse = Waves(shape, pixel, surface.periodic)
    heights = surface.waves.resampled(surface.heights, coarse)
    return replace(surface, heights=heights, pixel=pixel)


def statistics(surface: Surface) -> Statistics:
    """Figures of a surface; slopes are those of its Fourier series."""
    z = surface.heights - surface.heights.mean()
    power, q = surface.waves.power(z), surface.waves.q
    rms = float(np.sqrt(np.mean(z**2)))
    slope = float(np.sqrt((q**2 * power).sum()))
    return Statistics(rms, slope, float(np.mean(z**3)) / rms**3)


def spectrum(surface: Surface) -> Spectrum:
    """Spectrum of a surface, averaged over rings of the width of the lowest wave number."""
    waves = surface.waves
    power, q = waves.power(surface.heights - surface.heights.mean()), waves.q
    sides = surface.size if surface.periodic else (2.0 * surface.size[0], 2.0 * surface.size[1])
    lowest = 2.0 * np.pi / max(sides)
    ring = np.rint(q / lowest).astype(int).ravel()
    shortest = np.pi / surface.pixel
    bins = np.arange(1, int(shortest / lowest) + 1)
    number = np.where(q.ravel() <= shortest, ring, 0)
    total = np.bincount(number, power.ravel(), minlength=bins.size + 2)[bins]
    count = np.bincount(number, waves.count.ravel(), minlength=bins.size + 2)[bins]
    full = count > 0
    area = sides[0] * sides[1]
    return Spectrum((lowest * bins[full]).astype(float), area * total[full] / count[full])


def spectrum_fit(found: Spectrum, shortest_wave: float) -> SpectrumFit | None:
    """Least-squares fit of logarithms for waves down to `shortest_wave` (m); None if too few."""
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
