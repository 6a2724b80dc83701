"""A rough elastic half-space pressed on a rigid plane, without friction or adhesion.

The surface is periodic or mirrored, on a grid. Displacements are computed by FFT, pressures by
bound-constrained conjugate gradients (Polonsky and Keer, Wear 231 (1999) 206-219). The
preconditioner is the stiffness of the half-space restricted to the contact; it reduces the
iterations to a quarter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn, irfft2, next_fast_len, rfft2

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped

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


TOLERANCE = 1e-7
MOST_ITERATIONS = 2000


class Contact(NamedTuple):
    """A rough surface on a plane; arrays of the map's shape (rows, columns).

    pressure: Pa, positive exactly in contact; gap: m, zero in contact; error: residual of gap times
    pressure and of overlap, over the rms height.
    """

    pressure: Array
    gap: Array
    iterations: int
    error: float


def compliance(waves: Waves, modulus: float) -> Array:
    """Displacement over pressure of every wave: 2 / (E* |q|), m/Pa.

    Johnson, *Contact Mechanics*, 1985, section 13.2. The mean displacement of a half-space is
    undefined, and set to zero. modulus: E*, Pa.
    """
    q = waves.q
    q[0, 0] = inf
    return np.asarray(2.0 / (modulus * q))


def press(
    heights: Array,
    pixel: float,
    modulus: float,
    pressures: Sequence[float],
    tolerance: float = TOLERANCE,
    periodic: bool = True,
) -> Iterator[Contact]:
    """Press the surface on the plane with each mean pressure (Pa); ascending ones are fastest.

    heights: m, (rows, columns), asperities up, periodic or continued by mirror images; pixel: m;
    modulus: E* = E / (1 - nu^2) of the rubber, Pa. Raises SimulationStopped if the iteration does
    not converge.
    """
    waves = Waves((heights.shape[0], heights.shape[1]), pixel, periodic)
    soft = compliance(waves, modulus)
    heights = heights - heights.mean()
    distribution = np.ones_like(heights)
    for mean in pressures:
        contact = pressed(heights, waves, soft, distribution * mean, tolerance)
        yield contact
        distribution = contact.pressure / mean


def pressed(heights: Array, waves: Waves, soft: Array, p: Array, tolerance: float) -> Contact:
    """Pressure and gap at the mean pressure of the first guess `p` (Pa).

    soft: see `compliance`; heights: m, of mean 0; arrays have the map's shape. Raises
    SimulationStopped, as `press`. The solution minimises p.u/2 - p.h over p >= 0 with the given
    mean, with the displacement u of p. The gradient, g = u - h minus its mean over the contact, is
    the gap at the solution.
    """
    mean, rms = float(p.mean()), float(np.sqrt(np.mean(heights**2)))
    if rms == 0.0:
        return Contact(p, np.zeros_like(p), 0, 0.0)
    stiff = np.divide(1.0, soft, out=np.zeros_like(soft), where=soft > 0.0)
    u = waves.filtered(soft, p)
    step, before, last = np.zeros_like(p), np.zeros_like(p), inf
    for iteration in range(MOST_ITERATIONS):
        touching = p > 0.0
        count = float(np.count_nonzero(touching))
        g = u - heights
        g -= np.vdot(p, g) / p.sum()
        overlap = -float(g.min(where=~touching, initial=0.0))
        error = max(float(np.vdot(p, np.abs(g)) / p.sum()), overlap) / rms
        if error <= tolerance:
            g[touching] = 0.0
            return Contact(p, np.maximum(g, 0.0, out=g), iteration, error)

        inside = g * touching
        inside -= inside.sum() / count * touching
        preconditioned = waves.filtered(stiff, inside) * touching
        preconditioned -= preconditioned.sum() / count * touching
        size = float(np.vdot(inside, preconditioned))
        # Polak and Ribiere's factor: it restarts automatically when the contact changes.
        step *= max(0.0, (size - float(np.vdot(before, preconditioned))) / last)
        step += preconditioned
        step *= touching
        before, last = inside, size or inf
        response = waves.filtered(soft, step)
        curvature = np.vdot(step, response) - step.sum() * np.vdot(response, touching) / count
        slope = float(np.vdot(inside, step))
        length = slope / float(curvature) if slope else 0.0
        moved = p - length * step

        linear = moved.min() >= 0.0
        np.maximum(moved, 0.0, out=moved)
        if overlap > 0.0:
            # Pixels that come into contact get the mean ratio of change to gap; a single pixel has
            # none.
            stiffness = float(stiff[stiff > 0.0].min())
            if slope:
                stiffness = length * slope / float(np.vdot(inside, inside))
            entering = ~touching & (g < 0.0)
            moved[entering] = -stiffness * g[entering]
            linear = False
        factor = mean / float(moved.mean())
        p = moved * factor
        u = (u - length * response) * factor if linear else waves.filtered(soft, p)
    raise SimulationStopped(
        f"the contact at {mean:.4g} Pa has not converged in {MOST_ITERATIONS} iterations "
        f"(error {error:.2g} of the rms height)"
    )
