"""k, D and H_V over the local pressure: a table or constants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Index, Mask


class ContactParameters(NamedTuple):
    """Contact parameters at a local pressure; arrays of the pressure's shape.

    k: relative contact area; D: mean asperity diameter, m; H_V: mean free height, m;
    dk_dp: derivative of k with respect to pressure, 1/Pa.
    """

    k: Array
    D: Array
    H_V: Array
    dk_dp: Array


class ContactLaw(Protocol):
    """k, D and H_V as functions of pressure."""

    def __call__(self, pressure: ArrayLike) -> ContactParameters:
        """Parameters at `pressure` (Pa, any shape)."""

    def contact_area(self, pressure: ArrayLike) -> tuple[Array, Array]:
        """k alone at `pressure` (Pa, any shape), and its derivative by it, 1/Pa."""

    def outside(self, pressure: ArrayLike) -> Mask:
        """Mask of `pressure` (Pa) without data."""


@dataclass(frozen=True)
class ContactTable:
    """k, D (m) and H_V (m) at two or more ascending pressures (Pa); clamped outside.

    Interpolation is linear in log-log. source: of the table, for messages; youngs_modulus: of the
    table's rubber, Pa, if known.
    """

    source: str
    pressure: tuple[float, ...]
    k: tuple[float, ...]
    D: tuple[float, ...]
    H_V: tuple[float, ...]
    youngs_modulus: float | None = None

    def at_modulus(self, modulus: float) -> ContactTable:
        """The table of the same surface on rubber of another Young's modulus (Pa).

        Elastic contact with small slopes depends on p / E only.
        """
        assert self.youngs_modulus is not None  # by Scene's validation
        stiffer = modulus / self.youngs_modulus
        pressure = tuple(stiffer * p for p in self.pressure)
        return replace(self, pressure=pressure, youngs_modulus=modulus)

    def __call__(self, pressure: ArrayLike) -> ContactParameters:
        """Evaluate at `pressure` (Pa, any shape; values below or above the table are clamped)."""
        line = self._line(pressure)
        k, dk_dp = self._contact_area(line)
        return ContactParameters(k, _power_law(self.D, line), _power_law(self.H_V, line), dk_dp)

    def contact_area(self, pressure: ArrayLike) -> tuple[Array, Array]:
        """k alone at `pressure` (Pa, any shape), and its derivative by it, 1/Pa."""
        return self._contact_area(self._line(pressure))

    def _contact_area(self, line: _OnLine) -> tuple[Array, Array]:
        k = _power_law(self.k, line)
        return k, np.where(line.inside, self._slopes[line.interval] * k / line.pressure, 0.0)

    @cached_property
    def _nodes(self) -> Array:
        return np.array(self.pressure)

    @cached_property
    def _spans(self) -> Array:
        return np.log(self._nodes[1:] / self._nodes[:-1])

    @cached_property
    def _slopes(self) -> Array:
        return np.log(_steps(self.k)[1]) / self._spans

    def _line(self, pressure: ArrayLike) -> _OnLine:
        nodes, given = self._nodes, np.asarray(pressure, dtype=float)
        p = np.minimum(np.maximum(given, nodes[0]), nodes[-1])
        i = np.minimum(nodes.searchsorted(p, side="right") - 1, nodes.size - 2)
        inside = (given > nodes[0]) & (given < nodes[-1])
        return _OnLine(i, np.log(p / nodes[i]) / self._spans[i], p, inside)

    def outside(self, pressure: ArrayLike) -> Mask:
        """Where `pressure` (Pa) lies outside the table's range, to rounding."""
        p = np.asarray(pressure)
        return (p < self.pressure[0] * (1 - 1e-9)) | (p > self.pressure[-1] * (1 + 1e-9))


class _OnLine(NamedTuple):
    """Position of pressures in a table.

    Interval, position in it, clamped pressure (Pa), and whether the pressure is inside the table.
    """

    interval: Index
    fraction: Array
    pressure: Array
    inside: Mask


def _power_law(values: tuple[float, ...], line: _OnLine) -> Array:
    """Log-log linear interpolation between the `values` of a table."""
    at, steps = _steps(values)
    return np.asarray(at[line.interval] * steps[line.interval] ** line.fraction)


@lru_cache
def _steps(values: tuple[float, ...]) -> tuple[Array, Array]:
    """The `values` of a table as an array, and ratios of successive values."""
    at = np.array(values)
    return at, at[1:] / at[:-1]


@dataclass(frozen=True)
class ConstantContact:
    """Contact parameters independent of pressure (given in the scene)."""

    k: float
    D: float
    H_V: float

    def __call__(self, pressure: ArrayLike) -> ContactParameters:
        """The constants, broadcast to the shape of `pressure` (Pa)."""
        one = np.ones_like(np.asarray(pressure, dtype=float))
        return ContactParameters(self.k * one, self.D * one, self.H_V * one, 0.0 * one)

    def contact_area(self, pressure: ArrayLike) -> tuple[Array, Array]:
        """k in the shape of `pressure` (Pa), and its derivative 0."""
        one = np.ones_like(np.asarray(pressure, dtype=float))
        return self.k * one, 0.0 * one

    def outside(self, pressure: ArrayLike) -> Mask:
        """Nowhere: constants hold at every pressure."""
        return np.zeros(np.shape(pressure), dtype=bool)
