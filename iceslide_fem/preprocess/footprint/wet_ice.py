"""Ice that brings water to the leading edge of a footprint, whose voids then carry with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.carrying import CarryingLoads
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.voids import Voids
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable


class WetIce(NamedTuple):
    """Water of a `height` (m) on the ice, and the length of the `lug` (m) that it flows out of."""

    height: float
    lug: float

    def voids(self, contact_of: ContactTable | ConstantContact) -> Voids:
        """Those between rubber and ice, of a table of k, D and H_V."""
        assert isinstance(contact_of, ContactTable)  # options of wet ice have nothing else
        return Voids(contact_of, self.lug)

    def loads(
        self,
        touching: FilmLoads,
        pressure: Array,
        contact_of: ContactTable | ConstantContact,
        viscosity: float,
    ) -> CarryingLoads:
        """Loads of films under `pressure` (Pa, (n,)), all of which is contact, with water of this
        `viscosity` (Pa s); touching: those where asperities bear all of it.
        """
        cover = np.ones_like(pressure)
        return CarryingLoads(self.voids(contact_of), touching, pressure, cover, viscosity)

    def borne(
        self, pressure: Array, water: Array, contact_of: ContactTable | ConstantContact
    ) -> Array:
        """p_f (Pa) that `water` of these heights (m) bears of a `pressure` (Pa), of any shape."""
        return pressure - self.voids(contact_of).contact_pressure(pressure, water)
