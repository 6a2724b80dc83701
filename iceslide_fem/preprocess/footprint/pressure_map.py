"""Module 1: the pressure map and figures of the contact; SI units."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError


@dataclass(frozen=True)
class PressureMap:
    """Contact pressure on pixels; `pressure` (ny, nx) in Pa, 0 without contact.

    dx, dy: size of a pixel (m). x grows with the columns, y with the rows.
    """

    pressure: Array
    dx: float
    dy: float

    @property
    def contact(self) -> Mask:
        """Pixels in contact, (ny, nx)."""
        return self.pressure > 0.0

    @property
    def pixel_area(self) -> float:
        """A_pixel of (4.5), m2; the thesis takes square pixels."""
        return self.dx * self.dy

    @property
    def contact_area(self) -> float:
        """A_tot = A_pixel N_contact, (4.6), m2."""
        return self.pixel_area * int(self.contact.sum())

    @property
    def gross_area(self) -> float:
        """Gross area: between the first and last pixel in contact of rows and columns, m2."""
        contact = self.contact
        inside = _between_ends(contact, 0) | _between_ends(contact, 1)
        return self.pixel_area * int(inside.sum())

    @property
    def contact_length(self) -> float:
        """From the first to the last column of pixels in contact, m."""
        columns = np.flatnonzero(self.contact.any(axis=0))
        return float(1 + columns[-1] - columns[0]) * self.dx

    @property
    def mean_pressure(self) -> float:
        """p_av: load over contact area, Pa."""
        return self.load / self.contact_area

    @property
    def load(self) -> float:
        """Integral of the pressure, N."""
        return float(self.pressure.sum()) * self.pixel_area

    @property
    def x(self) -> Array:
        """Middle of each column of pixels, m."""
        return (np.arange(0.0, self.pressure.shape[1]) + 0.5) * self.dx

    @property
    def y(self) -> Array:
        """Middle of each row of pixels, m."""
        return (np.arange(0.0, self.pressure.shape[0]) + 0.5) * self.dy

    def sample(self, lines: int) -> Array:
        """Pressures (n, nx), Pa, of about `lines` lines, evenly chosen among touching ones."""
        touching = np.flatnonzero(self.contact.any(axis=1))
        every = max(1, touching.size // lines)
        return self.pressure[touching[every // 2 :: every]]

    def carrying(self, load: float) -> tuple[PressureMap, float]:
        """The map scaled to carry `load` (N), and the factor on the pressures."""
        factor = load / self.load
        return replace(self, pressure=factor * self.pressure), factor

    def summary(self) -> dict[str, Any]:
        """The figures of module 1, in SI units as in the names."""
        return {
            "contact_length_m": self.contact_length,
            "pixels": list(self.pressure.shape[::-1]),
            "pixel_size_m": [self.dx, self.dy],
            "contact_area_m2": self.contact_area,
            "net_to_gross": self.contact_area / self.gross_area,
            "mean_pressure_Pa": self.mean_pressure,
            "max_pressure_Pa": float(self.pressure.max()),
            "load_N": self.load,
        }


def touching(pressure: Array, threshold: float) -> Array:
    """Pressures with 0 up to the `threshold` of contact, Pa, any shape.

    Raises SceneError if no pixel is in contact.
    """
    kept = np.where(pressure > threshold, pressure, 0.0)
    if not kept.any():
        raise SceneError(
            f"no pixel is in contact: no pressure is above the threshold of {threshold:.4g} Pa"
        )
    return kept


def pressure_from_values(
    value: Array, low: float, high: float, threshold: float, size: tuple[float, float]
) -> PressureMap:
    """P = Pmin + value (Pmax - Pmin), corrected (4.4); no contact up to `threshold` (Pa).

    value: 0 to 1, first row on top of the picture; low, high: Pmin and Pmax, Pa; size: length along
    x and width along y, m. The thesis prints P = G / Pmax for (4.4), which does not fulfil its own
    (4.2) and (4.3). Raises SceneError if no pixel is in contact.
    """
    pressure = touching(low + value[::-1] * (high - low), threshold)
    rows, columns = value.shape
    return PressureMap(pressure, size[0] / columns, size[1] / rows)


@dataclass(frozen=True)
class GaussianLine:
    """Centre line of the 1-D model: p = peak exp(-(x - centre)^2 / (2 sigma^2)); Pa and m."""

    peak: float
    centre: float
    sigma: float

    def __call__(self, x: Array) -> Array:
        """Pressure (Pa) at `x` (m)."""
        return self.peak * np.exp(-((x - self.centre) ** 2) / (2.0 * self.sigma**2))


LINE_PIXELS = 540  # of a generated profile


def gaussian_profile(
    length: float, peak: float, points: int = LINE_PIXELS, sigma: float | None = None
) -> tuple[Array, Array]:
    """x (m) and pressure (Pa) of fig. 6: a Gaussian in the middle of `length` (m), `peak` in Pa.

    sigma: m; else a sixth of the length. The thesis prints neither peak nor width.
    """
    x = (np.arange(0.0, points) + 0.5) * (length / points)
    return x, GaussianLine(peak, length / 2.0, length / 6.0 if sigma is None else sigma)(x)


def as_map(pressure: ArrayLike, dx: float) -> PressureMap:
    """A line of pixels of length `dx` (m) with `pressure` (nx,), Pa, as a map 1 m wide.

    Raises SceneError if nothing is in contact.
    """
    row = np.atleast_2d(np.asarray(pressure, dtype=float))
    if not (row > 0.0).any():
        raise SceneError("the line touches nowhere: no pressure is above 0")
    return PressureMap(row, dx, 1.0)


def gaussian_centre_line(footprint: PressureMap) -> GaussianLine:
    """Gaussian with the load, the centre and the spread of the pressure along x.

    The mean over y of all touching lines is the load per area of the line.
    """
    lines = footprint.pressure[footprint.contact.any(axis=1)]
    line, x = lines.mean(axis=0), footprint.x
    centre = float(np.average(x, weights=line))
    spread = float(np.average((x - centre) ** 2, weights=line)) + footprint.dx**2 / 12.0
    sigma = spread**0.5
    peak = float(line.sum()) * footprint.dx / (sigma * (2.0 * np.pi) ** 0.5)
    return GaussianLine(peak, centre, sigma)


def _between_ends(contact: Mask, axis: int) -> Mask:
    """Pixels in contact, or with contact on both sides, along `axis`."""
    before = np.logical_or.accumulate(contact, axis=axis)
    after = np.flip(np.logical_or.accumulate(np.flip(contact, axis), axis=axis), axis)
    return before & after
