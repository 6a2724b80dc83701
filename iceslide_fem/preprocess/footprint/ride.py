"""How ice passes a footprint, and what its films are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.contact_age import ContactAge
from iceslide_fem.film.limiting_shear import LimitingShear
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.preprocess.footprint.wet_ice import WetIce
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import ICE, WATER_VISCOSITY, Solid, ViscosityTable
from iceslide_fem.scene.shear_strength import ShearStrength

FIRST_HEIGHT = 70e-9  # m, the thesis's
NOTHING = 1e-15  # m, that voids can pass on whose water stays where it is: they are full


class Ride(NamedTuple):
    """How ice passes the footprint: V and the sliding speed V S (m/s), T_0 (K), h0 (m).

    T_0 and V S may be arrays (ny,), one value for each line. water_speed: of squeezed-out water
    relative to the rubber, a fraction of the sliding speed. Tables of the viscosity are read at
    the film's temperature. strength: tau_b of dry rubber on ice, where that limits the shear; then
    h0 may be 0, and the viscosity is a number. age: how the contact ages, where it does. wet: water
    on the ice, where voids carry; then the viscosity is a number, and water_speed 1.
    """

    speed: float
    sliding_speed: float | Array
    temperature: float | Array
    initial_height: float = FIRST_HEIGHT
    solid: Solid = ICE
    viscosity: float | ViscosityTable = WATER_VISCOSITY
    water_speed: float = 1.0
    strength: ShearStrength | None = None
    age: ContactAge | None = None
    wet: WetIce | None = None

    @property
    def limit(self) -> LimitingShear | None:
        """What limits the shear of the films."""
        if self.strength is None:
            return None
        assert not isinstance(self.viscosity, ViscosityTable)
        fastest = float(np.max(self.sliding_speed))
        return LimitingShear.of(self.strength, self.viscosity, fastest)

    def lines(self, some: Index) -> Ride:
        """The ride of `some` of the lines."""
        temperature, speed = (
            np.asarray(one)[some] if np.ndim(one) else np.full(some.size, one)
            for one in (self.temperature, self.sliding_speed)
        )
        return self._replace(temperature=temperature, sliding_speed=speed)

    @property
    def water_fraction(self) -> float | Array:
        """w / V of the water below the rubber, which itself passes the footprint at V (1 - S)."""
        return 1.0 - self.sliding_speed / self.speed * (1.0 - self.water_speed)

    @property
    def thinnest_layer(self) -> float | Array:
        """Of squeezed-out water on the ice, m."""
        return np.where(np.asarray(self.water_fraction) > 0.0, 0.0, NOTHING)

    @property
    def first_layer(self) -> float | Array:
        """Of water on the ice ahead of contact, m."""
        return self.thinnest_layer if self.wet is None else self.wet.height

    def water(self, lines: int) -> tuple[Array, VariableViscosity | None]:
        """Viscosity of every line (Pa s), (lines,), and how it follows the temperature."""
        viscosity = np.broadcast_to(self.viscosity_at(self.temperature), (lines,)).copy()
        if not isinstance(self.viscosity, ViscosityTable):
            return viscosity, None
        return viscosity, VariableViscosity(self.viscosity, viscosity)

    def viscosity_at(self, temperature: float | Array) -> Array:
        """Of the water (Pa s) at temperatures (K) of any shape."""
        given = self.viscosity
        if isinstance(given, ViscosityTable):
            return given(temperature)
        return np.full_like(np.asarray(temperature, dtype=float), given)
