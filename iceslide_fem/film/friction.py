"""The film's friction under a contact pressure: its loads, its shear stress, and their slopes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.film.integrators import InterfaceState, Loads
from iceslide_fem.film.law import FilmLoads, film_loads, log_shearing
from iceslide_fem.film.viscosity import Thinning
from iceslide_fem.materials import (
    WATER_VISCOSITY,
    ConstantContact,
    ContactTable,
    ViscosityTable,
)

# Shear (Pa) of pressures (Pa) and slip speeds (m/s), and its derivatives by both; arrays (n,) or
# any other shape of as many.
Sheared = Callable[[Array, Array], tuple[Array, Array, Array]]


class Friction(Protocol):
    """The law of a scene, as carriers and block know it."""

    @property
    def is_own(self) -> bool:
        """Whether it is a law of the scene's own: foreign code, of which nothing is known."""

    @property
    def fault(self) -> str | None:
        """What such a law has done wrong, on this rank."""

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """ln h, H_s and memory of `n` points before anything has happened."""

    def loads(self, pressure: Array, speed: Array) -> Loads:
        """What acts under the law at local `pressure` (Pa) and `speed` (m/s)."""

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """Shear at points that have `state`, on ice of that temperature (K)."""

    def at_start(self, film_height: float, n: int) -> Sheared:
        """Shear of `n` points before anything has happened."""

    def outside(self, pressure: Array) -> Mask:
        """Where the law has no data of its own for the pressure."""


@dataclass(frozen=True, eq=False)
class FilmFriction:
    """The film law's parameters as they follow from the contact pressure.

    parameters: k, D, H_V of the pressure; nominal: the pressure (Pa) that they and the squeeze
    term follow instead of the local one, or None; ramp_pressure: shear is faded in over this
    pressure (Pa), because the film's shear does not vanish with p and would jump where an edge
    touches down; viscosity: eta of the water (Pa s), of a `table` that at the ice's initial
    temperature.
    """

    parameters: ContactTable | ConstantContact
    nominal: float | None
    ramp_pressure: float
    viscosity: float = WATER_VISCOSITY
    table: ViscosityTable | None = None
    is_own: ClassVar[bool] = False
    fault: ClassVar[str | None] = None

    def loads(self, pressure: Array, speed: Array) -> FilmLoads:
        """Loads of the film at local `pressure` (Pa) and `speed` (m/s)."""
        p = self._read_at(pressure)
        k, D, H_V, _ = self.parameters(p)
        ramp, _ = self._ramp(pressure)
        p, k = np.where(pressure > 0.0, p, 0.0), ramp * k
        return film_loads(p, speed, k, D, H_V, self.viscosity, self._thinning)

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """Films of the height (m), nothing squeezed out; with a table ln(eta / eta_0) = 0."""
        remembered = 0 if self.table is None else 1
        return np.full(n, np.log(film_height)), np.zeros(n), np.zeros((remembered, n))

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """Shear of films as they are in `state`, whatever the temperature."""
        return self.over(np.exp(-log_shearing(state)))

    def at_start(self, film_height: float, n: int) -> Sheared:
        """Shear of `n` films of the height (m)."""
        return self.over(np.full(n, film_height))

    def over(self, film_height: Array) -> Sheared:
        """Shear of films of these heights over eta / eta_0 (n,), m."""

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            height = film_height.reshape(pressure.shape)
            unit, slope = self.shear(pressure, np.ones_like(height), height)
            return unit * speed, slope * speed, unit

        return shear

    def shear(self, pressure: Array, speed: Array, film_height: Array) -> tuple[Array, Array]:
        """tau = k eta v / h (5.29), faded in with pressure (Pa), and d tau / d p."""
        k, dk_dp = self.parameters.contact_area(self._read_at(pressure))
        if self.nominal is not None:
            dk_dp = np.zeros_like(dk_dp)
        ramp, slope = self._ramp(pressure)
        factor = self.viscosity * speed / film_height
        return ramp * k * factor, (slope * k + ramp * dk_dp) * factor

    def outside(self, pressure: Array) -> Mask:
        """Whether the table of k, D, H_V does not cover the pressure at which it is read."""
        return self.parameters.outside(self._read_at(pressure))

    @property
    def _thinning(self) -> Thinning | None:
        return None if self.table is None else Thinning(self.table, self.viscosity)

    def _read_at(self, pressure: Array) -> Array:
        """The pressure that k, D, H_V and the squeeze term follow, Pa."""
        return pressure if self.nominal is None else np.full_like(pressure, self.nominal)

    def _ramp(self, pressure: Array) -> tuple[Array, Array]:
        x = pressure / self.ramp_pressure
        return np.clip(x, 0.0, 1.0), np.where((x > 0.0) & (x < 1.0), 1.0 / self.ramp_pressure, 0.0)
