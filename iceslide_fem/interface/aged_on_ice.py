"""Films on the ice's nodes below contact that ages: a piece of ice has a contact of its own.

Its age is the time for which the ice has been below the rubber. Points shear as contact that has
just touched down does, times the growth of k of the nodes around them, so that the friction power
on both sides is the same to rounding.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.aged_loads import AgedLoads
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import log_shearing
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.interface.on_ice import FilmsOnNodes
from iceslide_fem.interface.window import place
from iceslide_fem.laws.aged_film import AgedFilm
from iceslide_fem.laws.interface_law import Sheared
from iceslide_fem.runtime.arrays import Array, Mask


class AgedOnIce(FilmsOnNodes[AgedLoads]):
    """Films on the ice's nodes, and the history of the contact above them."""

    _law: AgedFilm

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """Shear under the films around each point. Collective."""
        _, loads = self.on_nodes(contact)
        shearing = np.exp(log_shearing(state))
        here, aged = (
            self.at_points(values, contact) for values in (shearing, loads.growth(state) * shearing)
        )
        of_film = state._replace(internal=state.internal[: -self._law.age.rows])
        touching = self._law.read(here, self.internal_at_points(of_film, contact), contact.speed)
        growth = aged / here

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            factor = growth.reshape(pressure.shape)
            tau, by_pressure, by_speed = touching(pressure, speed)
            return factor * tau, factor * by_pressure, factor * by_speed

        return shear

    def _found_on_nodes(self, contact: ContactLoads) -> tuple[Mask, AgedLoads]:
        grid, loads = self.ice.grid, self._law.loads(contact.pressure, contact.speed)
        touching = contact.touching
        given = grid.scatter(np.stack([touching, touching * loads.pressure]), place(grid, contact))
        area, force = given[:, grid.own]
        covered, of_nodes = self._of_nodes(loads.touching, contact)
        pressure = np.divide(force, area, out=np.zeros_like(force), where=covered)
        mean = force / grid.cell_area[grid.own]
        return covered, loads._replace(touching=of_nodes, pressure=pressure, mean=mean)
