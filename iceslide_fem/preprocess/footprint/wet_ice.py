"""Wet ice at the leading edge of a footprint with load-bearing voids."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.carrying import CarryingLoads
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.voids import Voids
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable


class WetIce(NamedTuple):
    """Water of a `height` (m) on the ice, and the length of the `lug` (m) for outflow."""

    height: float
    lug: float

    def voids(self, contact_of: ContactTable | ConstantContact) -> Voids:
        """The voids between rubber and ice, from a table of k, D and H_V."""
        assert isinstance(contact_of, ContactTable)  # wet ice allows tables only
        return Voids(contact_of, self.lug)

    def loads(
        self,
        touching: FilmLoads,
        pressure: Array,
        contact_of: ContactTable | ConstantContact,
        viscosity: float,
    ) -> CarryingLoads:
        """Loads of films under `pressure` (Pa), (n,), in full contact, with `viscosity` (Pa s).

        touching: loads if the asperities bear all of the pressure.
        """
        cover = np.ones_like(pressure)
        return CarryingLoads(self.voids(contact_of), touching, pressure, cover, viscosity)

    def borne(
        self, pressure: Array, water: Array, contact_of: ContactTable | ConstantContact
    ) -> Array:
        """Pressure p_f (Pa) on `water` (m) under a `pressure` (Pa), any shape."""
        return pressure - self.voids(contact_of).contact_pressure(pressure, water)
