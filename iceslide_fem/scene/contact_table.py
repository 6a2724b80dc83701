"""k, D and H_V over the local pressure: a table or constants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.curve import LogCurve
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.columns import Wanted, check_range, read_columns

if TYPE_CHECKING:  # takes long to import, and only rough ice needs it
    from iceslide_fem.surfaces.combined_contact import Change


class ContactParameters(NamedTuple):
    """Contact parameters at a local pressure; arrays of the pressure's shape.

    k: relative contact area; D: mean asperity diameter, m; H_V: mean free height, m;
    dk_dp: derivative of k with respect to pressure, 1/Pa.
    """

    k: Array
    D: Array
    H_V: Array
    dk_dp: Array


@dataclass(frozen=True)
class ContactTable:
    """k, D (m) and H_V (m) over the same two or more pressures (Pa).

    source: of the table, for messages; youngs_modulus: of the table's rubber, Pa, if known.
    """

    source: str
    k: LogCurve
    D: LogCurve
    H_V: LogCurve
    youngs_modulus: float | None = None

    @property
    def pressure(self) -> tuple[float, ...]:
        """Pressures of the rows, Pa."""
        return self.k.x

    def at_modulus(self, modulus: float) -> ContactTable:
        """The table of the same surface on rubber of another Young's modulus (Pa).

        Elastic contact with small slopes depends on p / E only.
        """
        assert self.youngs_modulus is not None  # by Scene's validation
        stiffer = modulus / self.youngs_modulus
        k, D, H_V = (curve.scaled(stiffer) for curve in (self.k, self.D, self.H_V))
        return ContactTable(self.source, k, D, H_V, modulus)

    def scaled(self, k: float = 1.0, D: float = 1.0, H_V: float = 1.0) -> ContactTable:
        """The table with factors on k (at most 1 after it), D and H_V."""
        if k == D == H_V == 1.0:
            return self
        more = replace(self.k, values=tuple(min(k * one, 1.0) for one in self.k.values))
        D_curve, H_V_curve = self.D.scaled(values=D), self.H_V.scaled(values=H_V)
        return replace(self, k=more, D=D_curve, H_V=H_V_curve)

    def on_rough_ice(self, change: Change) -> ContactTable:
        """The table of the same rubber on rough ice, with what that changes."""
        rough = self.changed(np.array(self.pressure), change)
        k, D, H_V = (LogCurve(self.pressure, tuple(one)) for one in rough[:3])
        return replace(self, source=f"{self.source}, on rough ice", k=k, D=D, H_V=H_V)

    def changed(self, pressure: Array, change: Change) -> ContactParameters:
        """Parameters at `pressure` (Pa) on rough ice. Below the table k follows the pressure."""
        less = pressure * change.pressure
        found = self(less)
        share = np.minimum(less / self.pressure[0], 1.0)
        k, H_V = found.k * share, self.H_V(pressure) + change.gap
        return ContactParameters(k, found.D * change.width, H_V, found.dk_dp * change.pressure)

    def __call__(self, pressure: ArrayLike) -> ContactParameters:
        """Evaluate at `pressure` (Pa, any shape)."""
        place = self.k.place(pressure)
        k = self.k.at(place)
        found = k, self.D.at(place), self.H_V.at(place), self.k.slope_at(place, k)
        return ContactParameters(*found)

    def contact_area(self, pressure: ArrayLike) -> tuple[Array, Array]:
        """k alone at `pressure` (Pa, any shape), and its derivative by it, 1/Pa."""
        place = self.k.place(pressure)
        k = self.k.at(place)
        return k, self.k.slope_at(place, k)

    def k_and_D(self, pressure: ArrayLike) -> tuple[Array, Array]:
        """k and D (m) alone at `pressure` (Pa, any shape)."""
        place = self.k.place(pressure)
        return self.k.at(place), self.D.at(place)

    def outside(self, pressure: ArrayLike) -> Mask:
        """Where `pressure` (Pa) lies outside the table's range, to rounding."""
        p = np.asarray(pressure)
        return (p < self.pressure[0] * (1 - 1e-9)) | (p > self.pressure[-1] * (1 + 1e-9))


@dataclass(frozen=True)
class ConstantContact:
    """Contact parameters independent of pressure (given in the scene)."""

    k: float
    D: float
    H_V: float

    def scaled(self, k: float = 1.0, D: float = 1.0, H_V: float = 1.0) -> ConstantContact:
        """The constants with factors on k (at most 1 after it), D and H_V."""
        return ConstantContact(min(k * self.k, 1.0), D * self.D, H_V * self.H_V)

    def on_rough_ice(self, change: Change) -> ConstantContact:
        """The constants on rough ice, with what that changes."""
        k, D, H_V, _ = self.changed(np.ones(()), change)
        return ConstantContact(float(k), float(D), float(H_V))

    def changed(self, pressure: Array, change: Change) -> ContactParameters:
        """Parameters at `pressure` (Pa) on rough ice. k follows the pressure."""
        k, D, H_V, slope = self(pressure)
        return ContactParameters(k * change.pressure, D * change.width, H_V + change.gap, slope)

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


def contact_on(
    contact_of: ContactTable | ConstantContact, pressure: Array, rough: Change | None
) -> ContactParameters:
    """k, D and H_V under `pressure` (Pa), with what `rough` ice changes."""
    return contact_of(pressure) if rough is None else contact_of.changed(pressure, rough)


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
    pressure. Otherwise raises SceneError with `key`. A file that has not changed is read once.
    """
    try:
        known = path.stat()
    except OSError:  # the reader says why
        return _read(path, key)
    return _read(path, key, known.st_mtime_ns, known.st_size)


@lru_cache(maxsize=32)
def _read(path: Path, key: str, *version: int) -> ContactTable:
    """The table in a file of a `version`. Raises SceneError."""
    wanted = [column for column, _, _ in COLUMNS]
    table, found = read_columns(path, key, wanted, NEEDED)
    for column, low, high in COLUMNS:
        if column.name in found:
            check_range(table, column.heading, found[column.name], low, high)
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
    pressure, *columns = zip(*rows, strict=True)
    k, D, H_V = (LogCurve(pressure, column) for column in columns)
    return ContactTable(path.name, k, D, H_V, None if moduli is None else float(moduli[0]))
