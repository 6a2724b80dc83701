"""A user's law whose internal variables are on the ice's nodes."""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.interface.on_rubber import OnRubber
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, SurfaceGrid
from iceslide_fem.interface.window import place, shifted
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.laws.user_stage import UserLoads
from iceslide_fem.runtime.arrays import Array


class Nodes:
    """Nodes of `grid` as `laws.user_stage.Places`, below the points of `contacts`."""

    def __init__(self, grid: SurfaceGrid, contacts: Contacts) -> None:
        self._grid, self._contacts = grid, contacts

    def at_points(self, internal: Array) -> Array:
        """Internal variables (m, own nodes) interpolated to the points, (m, n). Collective."""
        rows = self._grid.allgather(internal)
        return np.array([self._grid.interpolate(row, self._contacts.at) for row in rows])

    def changed(self, internal: Array, by: Array) -> Array:
        """Internal variables of this rank's nodes after changes (m, n) at points. Collective."""
        grid, (at, area, _) = self._grid, self._contacts
        given = grid.scatter(area * by, at) / grid.cell_area
        return np.asarray(internal + given[:, grid.own])


class UserLawOnIce(OnRubber):
    """Friction at the rubber's points under a law with internal variables on ice nodes."""

    _law: UserLaw

    @property
    def internal_nodes(self) -> OwnNodes:
        """This rank's nodes of the window."""
        return self.ice.grid.nodes

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Initial internal variables on all nodes; cold ice and cold rubber."""
        state = super().start(film_height, n_points)
        return state._replace(internal=self._law.initial(film_height, self.ice.grid.own.size)[2])

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """The shear law of each point, from the variables around it. Collective."""
        here = state._replace(internal=self.internal_at_points(state, contact))
        return self._law.sheared(here, lambda: self.ice_temperature(state, contact))

    def internal_at_points(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Internal variables of the nodes, interpolated to the points. Collective."""
        contacts = Contacts(place(self.ice.grid, contact), contact.touching)
        return Nodes(self.ice.grid, contacts).at_points(state.internal)

    def _over_fresh_ice(self, state: InterfaceState, cells: int) -> InterfaceState:
        """The ice takes its variables along. Collective."""
        first = np.array(self._law.internal_at_start)[:, None]
        internal = shifted(self.ice.grid, state.internal, cells, first)
        return super()._over_fresh_ice(state, cells)._replace(internal=internal)

    def _acting(self, contact: ContactLoads, contacts: Contacts, age: Array) -> UserLoads:
        loads = self._law.loads(contact.pressure, contact.speed, age)
        return loads._replace(places=Nodes(self.ice.grid, contacts))
