"""Water in the voids between rubber and ice that carries a part of the pressure.

The voids below rubber hold H_V(p_c) of water at the contact pressure p_c. With W (m) in them

    p = p_c + p_f,   0 <= p_f,   H_V(p - p_f) - W >= 0,   one of both 0        (1)

so full voids share the load: the water bears p_f, the asperities p_c, and k, D and the squeeze-out
are those of p_c. Water under pressure flows out to the edges of a lug of the length B (m), as a
film between plane faces of a long strip does (O. Reynolds, Phil. Trans. R. Soc. 177 (1886) 157):

    dW/dt = ... - p_f W^3 / (eta B^2)                                          (2)

Ice that brings more water than voids hold is so wet ice: p_c is 0 until it is squeezed out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.contact_table import ContactTable

NO_CONTACT = 1e-12  # k of asperities that hardly touch


@dataclass(frozen=True)
class Voids:
    """Those of a contact `table`; `lug`: the length B (m), of all places or (n,), infinite where
    nothing flows out.

    Below the lowest pressure of the table k goes with the pressure, D stays, and H_V goes on
    straight in log-log; above the highest H_V does, too.
    """

    table: ContactTable
    lug: Array | float = np.inf

    @cached_property
    def _heights(self) -> tuple[Array, Array]:
        """ln H_V, falling, and ln p of the table, without rows in which H_V stays."""
        height, pressure = np.log(self.table.H_V), np.log(self.table.pressure)
        kept = np.append(np.diff(height) < 0.0, True)
        return height[kept], pressure[kept]

    def carried(self, water: Array) -> Array:
        """The contact pressure (Pa) at which voids hold just this `water` (m, (n,)); infinite
        where there is none, or less: stages of a step that is too long begin so.
        """
        height, pressure = self._heights
        with np.errstate(divide="ignore"):
            log = np.log(np.maximum(water, 0.0))
        if height.size == 1:
            return np.where(log < height[0], np.inf, 0.0)
        with np.errstate(over="ignore"):
            found = np.exp(_straight(-log, -height, pressure))
        return np.where(water > 0.0, found, np.inf)

    def contact_pressure(self, pressure: Array, water: Array) -> Array:
        """p_c (Pa) of (1) under `pressure` (Pa) with `water` (m) in the voids, (n,)."""
        return np.minimum(np.maximum(pressure, 0.0), self.carried(water))

    def contact(self, pressure: Array) -> tuple[Array, Array]:
        """k and D (m) under contact pressures (Pa), (n,)."""
        k, D, _, _ = self.table(pressure)
        share = np.minimum(pressure / self.table.pressure[0], 1.0)
        return np.maximum(k * share, NO_CONTACT), D

    def held(self, pressure: Array) -> Array:
        """H_V (m) at contact pressures (Pa), (n,): the inverse of `carried`."""
        height, log = self._heights
        if height.size == 1:
            return np.full_like(pressure, np.exp(height[0]))
        return np.exp(_straight(np.log(np.maximum(pressure, 1e-300)), log, height))

    def outflow(self, borne: Array, water: Array, viscosity: Array | float) -> Array:
        """p_f W^2 / (eta B^2), 1/s: what of the `water` W (m) flows out in a second by (2), where
        it bears p_f = `borne` (Pa), (n,).
        """
        return np.asarray(borne * water**2 / (viscosity * self.lug**2))


def _straight(at: Array, x: Array, y: Array) -> Array:
    """Straight lines through two or more places y at rising x, and beyond them."""
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    slope = (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    with np.errstate(invalid="ignore"):
        return np.asarray(y[i] + slope * (at - x[i]))
