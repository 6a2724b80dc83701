"""Water in the voids between rubber and ice, which bears a part of the pressure.

The voids below rubber hold H_V(p_c) of water at the contact pressure p_c. With W (m) in them

    p = p_c + p_f,   0 <= p_f,   H_V(p - p_f) - W >= 0,   one of both 0        (1)

Full voids share the load: the water bears p_f and the asperities p_c. k, D and the squeeze-out are
those at p_c. Water under pressure flows out to the edges of a lug of the length B (m), as a film
between the plane faces of a long strip (O. Reynolds, Phil. Trans. R. Soc. 177 (1886) 157):

    dW/dt = ... - p_f W^3 / (eta B^2)                                          (2)

If ice brings more water than the voids hold, p_c is 0 until the water is squeezed out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.contact_table import ContactTable

NO_CONTACT = 1e-12  # k at the limit of contact


@dataclass(frozen=True)
class Voids:
    """Voids of a contact `table`; lug: length B (m), scalar or (n,), infinite without outflow.

    Below the lowest pressure of the table k is proportional to pressure, D is constant, and H_V is
    extrapolated linearly in log-log. Above the highest pressure H_V is extrapolated likewise.
    """

    table: ContactTable
    lug: Array | float = np.inf

    @cached_property
    def _heights(self) -> tuple[Array, Array]:
        """ln H_V, decreasing, and ln p of the table, without rows of equal H_V."""
        height, pressure = np.log(self.table.H_V.values), np.log(self.table.pressure)
        kept = np.append(np.diff(height) < 0.0, True)
        return height[kept], pressure[kept]

    def carried(self, water: Array) -> Array:
        """Contact pressure (Pa) at which the voids hold exactly this `water` (m, (n,)).

        Infinite for zero or negative water, which stages of a too long step may have.
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
        """H_V (m) at contact pressures (Pa), (n,): inverse of `carried`."""
        height, log = self._heights
        if height.size == 1:
            return np.full_like(pressure, np.exp(height[0]))
        return np.exp(_straight(np.log(np.maximum(pressure, 1e-300)), log, height))

    def outflow(self, borne: Array, water: Array, viscosity: Array | float) -> Array:
        """p_f W^2 / (eta B^2), 1/s: outflow rate of the `water` W (m) by (2), (n,).

        borne: its pressure p_f, Pa.
        """
        return np.asarray(borne * water**2 / (viscosity * self.lug**2))


def _straight(at: Array, x: Array, y: Array) -> Array:
    """Piecewise linear interpolation, with linear extrapolation beyond rising x."""
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    slope = (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    with np.errstate(invalid="ignore"):
        return np.asarray(y[i] + slope * (at - x[i]))
