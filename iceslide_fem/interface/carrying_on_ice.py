"""Films on the ice's nodes beside voids whose water carries: the water stays with the ice.

Points shear as contact whose asperities bear all of the pressure does, times what the sharing at
the nodes around them makes of that, so that the friction power on both sides is the same.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.carrying import CarryingLoads
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import log_shearing
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.interface.on_ice import FilmsOnNodes
from iceslide_fem.interface.window import place
from iceslide_fem.laws.carrying_film import CarryingFilm
from iceslide_fem.laws.interface_law import Sheared
from iceslide_fem.runtime.arrays import Array, Mask


class CarryingOnIce(FilmsOnNodes[CarryingLoads]):
    """Films on the ice's nodes, and water in the voids above them."""

    _law: CarryingFilm

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """Shear under the films around each point. Collective."""
        _, loads = self.on_nodes(contact)
        shearing = np.exp(log_shearing(state))
        here, shared = (
            self.at_points(values, contact) for values in (shearing, loads.growth(state) * shearing)
        )
        touching = self._law.read(here, state.internal, contact.speed)
        growth = shared / here

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            factor = growth.reshape(pressure.shape)
            tau, by_pressure, by_speed = touching(pressure, speed)
            return factor * tau, factor * by_pressure, factor * by_speed

        return shear

    def _found_on_nodes(self, contact: ContactLoads) -> tuple[Mask, CarryingLoads]:
        grid, loads = self.ice.grid, self._law.loads(contact.pressure, contact.speed)
        touching = contact.touching
        amounts = [touching, touching * loads.pressure, touching * loads.cover]
        given = grid.scatter(np.stack(amounts), place(grid, contact))
        area, force, faded = given[:, grid.own]
        covered, of_nodes = self._of_nodes(loads.touching, contact)
        pressure = np.divide(force, area, out=np.zeros_like(force), where=covered)
        cover = faded / grid.cell_area[grid.own]
        return covered, loads._replace(touching=of_nodes, pressure=pressure, cover=cover)
