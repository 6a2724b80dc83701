"""The film's friction under a contact pressure: its loads, its shear stress, and their slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.film.law import FilmLoads, film_loads
from iceslide_fem.materials import WATER_VISCOSITY, ConstantContact, ContactTable


@dataclass(frozen=True)
class FilmFriction:
    """The film law's parameters as they follow from the contact pressure.

    parameters: k, D, H_V of the pressure; nominal: the pressure (Pa) that they and the squeeze
    term follow instead of the local one, or None; ramp_pressure: shear is faded in over this
    pressure (Pa), because the film's shear does not vanish with p and would jump where an edge
    touches down; viscosity: eta of the water (Pa s).
    """

    parameters: ContactTable | ConstantContact
    nominal: float | None
    ramp_pressure: float
    viscosity: float = WATER_VISCOSITY

    def loads(self, pressure: Array, speed: Array) -> FilmLoads:
        """Loads of the film at local `pressure` (Pa) and `speed` (m/s)."""
        p, k, D, H_V, _ = self._parameters(pressure)
        ramp, _ = self._ramp(pressure)
        return film_loads(np.where(pressure > 0.0, p, 0.0), speed, ramp * k, D, H_V, self.viscosity)

    def shear(self, pressure: Array, speed: Array, film_height: Array) -> tuple[Array, Array]:
        """tau = k eta v / h (5.29), faded in with pressure (Pa), and d tau / d p."""
        _, k, _, _, dk_dp = self._parameters(pressure)
        ramp, slope = self._ramp(pressure)
        factor = self.viscosity * speed / film_height
        return ramp * k * factor, (slope * k + ramp * dk_dp) * factor

    def outside(self, pressure: Array) -> Mask:
        """Whether the table of k, D, H_V does not cover the pressure at which it is read."""
        return self.parameters.outside(self._parameters(pressure)[0])

    def _parameters(self, pressure: Array) -> tuple[Array, Array, Array, Array, Array]:
        if self.nominal is None:
            return (pressure, *self.parameters(pressure))
        p = np.full_like(pressure, self.nominal)
        k, D, H_V, dk_dp = self.parameters(p)
        return p, k, D, H_V, np.zeros_like(dk_dp)

    def _ramp(self, pressure: Array) -> tuple[Array, Array]:
        x = pressure / self.ramp_pressure
        return np.clip(x, 0.0, 1.0), np.where((x > 0.0) & (x < 1.0), 1.0 / self.ramp_pressure, 0.0)
