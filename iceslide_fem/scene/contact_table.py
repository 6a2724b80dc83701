"""k, D and H_V over the local pressure: a table or constants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.columns import Wanted, read_columns


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


# Column, lowest and highest value allowed (both included), SI.
COLUMNS = (
    (Wanted("pressure", "Pa", ("p", "nominal pressure")), 10.0, 1e9),
    (Wanted("k", ""), 1e-6, 1.0),
    (Wanted("D", "m"), 1e-8, 1e-2),
    (Wanted("H_V", "m"), 1e-12, 1e-2),
    (Wanted("youngs_modulus", "Pa"), 1e3, 1e11),
)
NEEDED = ("pressure", "k", "D", "H_V")


def read_contact_table(path: Path, key: str) -> ContactTable:
    """Table from a file with the columns pressure_Pa, k, D_m, H_V_m; other columns are ignored.

    The optional column youngs_modulus_Pa, constant over rows, is that of the table's rubber. Other
    units are named in the heading, as in "pressure (bar)". There are two or more rows in ascending
    pressure; lines that begin with # are comments. k must not fall and H_V must not rise with
    pressure. Otherwise raises SceneError with `key`.
    """
    wanted = [column for column, _, _ in COLUMNS]
    table, found = read_columns(path, key, wanted, NEEDED)
    for column, low, high in COLUMNS:
        if column.name not in found:
            continue
        for row, value in enumerate(found[column.name]):
            if not low <= value <= high:
                said = "is missing" if value != value else f"= {value:g} is out of range"
                raise SceneError(
                    f"{table.said}: row {row + 1} (line {table.lines[row].number}): "
                    f"{column.heading} {said}; allowed: {low:g} to {high:g}"
                )
    rows = list(zip(*(found[name].tolist() for name in NEEDED), strict=True))
    if len(rows) < 2:
        raise SceneError(f"{table.said} has {len(rows)} pressure; allowed: 2 or more")
    for number, (now, after) in enumerate(zip(rows[:-1], rows[1:], strict=True), start=1):
        for wrong, what in (
            (after[0] <= now[0], "pressure_Pa must rise from row to row"),
            (after[1] < now[1], "k must not fall when the pressure rises"),
            (after[3] > now[3], "H_V_m must not rise when the pressure rises"),
        ):
            if wrong:
                raise SceneError(f"{table.said}: rows {number} and {number + 1}: {what}")
    moduli = found.get("youngs_modulus")
    if moduli is not None and np.ptp(moduli) > 0.0:
        raise SceneError(
            f"{table.said}: youngs_modulus_Pa is {moduli.min():g} to {moduli.max():g}; allowed: "
            "the same in all rows, that of the rubber which the table is of"
        )
    pressure, k, D, H_V = zip(*rows, strict=True)
    modulus = None if moduli is None else float(moduli[0])
    return ContactTable(path.name, pressure, k, D, H_V, modulus)
