"""Values over one variable: loads over time, materials over temperature, contact over pressure.

A scene gives them as a number or as rows [x, value]. Beyond their rows all curves hold the value of
the nearest end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Index, Mask

if TYPE_CHECKING:  # slow to import, and only smooth curves need it
    from scipy.interpolate import PPoly

Rows = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Curve:
    """Values at ascending `x`, linear between rows. One row is a constant."""

    x: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(cls, given: float | Rows) -> Self:
        """The curve of a number, or of rows [x, value] in ascending x."""
        x, values = zip(*(given if isinstance(given, Sequence) else [(0.0, given)]), strict=True)
        return cls(x, values)

    @property
    def is_constant(self) -> bool:
        """Whether it has one value throughout."""
        return len(self.values) == 1

    def scaled(self, x: float = 1.0, values: float = 1.0) -> Self:
        """The same with factors on x and on the values."""
        return replace(
            self,
            x=tuple(x * one for one in self.x),
            values=tuple(values * one for one in self.values),
        )

    def __call__(self, x: ArrayLike) -> Array:
        """Values at `x`, any shape."""
        return np.asarray(np.interp(np.asarray(x), *self.arrays))

    @cached_property
    def pieces(self) -> Array:
        """Coefficients of cubics between rows, highest power first, (4, rows - 1)."""
        x, values = self.arrays
        slopes = np.diff(values) / np.diff(x)
        nothing = np.zeros_like(slopes)
        return np.stack([nothing, nothing, slopes, values[:-1]])

    @cached_property
    def arrays(self) -> tuple[Array, Array]:
        """x and values, (rows,) each."""
        return np.array(self.x), np.array(self.values)


@dataclass(frozen=True)
class SmoothCurve(Curve):
    """The same with monotone cubics between two or more rows (PCHIP with zero slope at both ends):
    continuous slope, no overshoot.
    """

    def __call__(self, x: ArrayLike) -> Array:
        """Values at `x`, any shape."""
        at = np.asarray(x, dtype=float)
        inside = self._polynomials(np.clip(at, self.x[0], self.x[-1]))
        inside = np.clip(inside, min(self.values), max(self.values))  # against rounding
        return np.where(at < self.x[-1], inside, self.values[-1])

    @cached_property
    def pieces(self) -> Array:
        """Coefficients of cubics between rows, highest power first, (4, rows - 1)."""
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

        slopes = np.zeros(len(self.x))  # at the ends, beyond which their values hold
        if len(self.x) > 2:
            slopes[1:-1] = PchipInterpolator(self.x, self.values)(self.x[1:-1], 1)
        return np.asarray(CubicHermiteSpline(self.x, self.values, slopes).c)

    @cached_property
    def _polynomials(self) -> PPoly:
        from scipy.interpolate import PPoly

        return PPoly(self.pieces, self.x)


class Place(NamedTuple):
    """Where x lies among rows: interval, position in it (0 to 1 in ln x), x held at the ends, and
    whether it is inside.
    """

    interval: Index
    fraction: Array
    x: Array
    inside: Mask


@dataclass(frozen=True)
class LogCurve(Curve):
    """Two or more rows with positive x and values; ln value is linear in ln x between them.

    Curves over the same x share a `place`.
    """

    def place(self, x: ArrayLike) -> Place:
        """The place of `x`, any shape."""
        nodes, given = self.arrays[0], np.asarray(x, dtype=float)
        held = np.minimum(np.maximum(given, nodes[0]), nodes[-1])
        i = np.minimum(nodes.searchsorted(held, side="right") - 1, nodes.size - 2)
        inside = (given > nodes[0]) & (given < nodes[-1])
        return Place(i, np.log(held / nodes[i]) / self._spans[i], held, inside)

    def at(self, place: Place) -> Array:
        """Values at a place."""
        i = place.interval
        return np.asarray(self.arrays[1][i] * self._ratios[i] ** place.fraction)

    def slope_at(self, place: Place, values: Array) -> Array:
        """Derivatives by x at a place with these `values`; 0 outside."""
        return np.where(place.inside, self._exponents[place.interval] * values / place.x, 0.0)

    def __call__(self, x: ArrayLike) -> Array:
        """Values at `x`, any shape."""
        return self.at(self.place(x))

    @cached_property
    def _ratios(self) -> Array:
        return self.arrays[1][1:] / self.arrays[1][:-1]

    @cached_property
    def _spans(self) -> Array:
        return np.log(self.arrays[0][1:] / self.arrays[0][:-1])

    @cached_property
    def _exponents(self) -> Array:
        return np.log(self._ratios) / self._spans
