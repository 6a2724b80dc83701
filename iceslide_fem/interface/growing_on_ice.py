"""Films on the ice's nodes under laws with a contact history: contact age, or water in voids.

Each piece of ice has its own history. The shear at a point is the shear without history, times a
factor from the history of the nodes around it. Points and nodes therefore have the same friction
power to rounding.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from iceslide_fem.film.aged_loads import AgedLoads
from iceslide_fem.film.carrying import CarryingLoads
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import FilmHistory, log_shearing
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.interface.film_frame import ContactLoads, Shifted
from iceslide_fem.interface.on_ice import FilmsOnNodes, Nodal
from iceslide_fem.interface.on_rubber import OnRubber
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, SurfaceGrid
from iceslide_fem.interface.window import place, shifted, whole_cells
from iceslide_fem.laws.aged_film import AgedFilm
from iceslide_fem.laws.carrying_film import CarryingFilm
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.laws.user_stage import UserLoads
from iceslide_fem.runtime.arrays import Array, Mask


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

    def shift_window(self, state: InterfaceState, offset: float, distance: float) -> Shifted:
        """Shift the ice with its variables. Collective."""
        grid = self.ice.grid
        cells, rest = whole_cells(grid, offset)
        if cells == 0:
            return Shifted(state, offset)
        internal = shifted(grid, state.internal, cells, list(self._law.internal_at_start))
        return Shifted(
            state._replace(ice=self.ice.shifted(state.ice, cells), internal=internal), rest
        )

    def _acting(self, contact: ContactLoads, contacts: Contacts) -> UserLoads:
        loads = self._law.loads(contact.pressure, contact.speed)
        return loads._replace(places=Nodes(self.ice.grid, contacts))


class Growing(Nodal, Protocol):
    """Loads whose contact has a history."""

    def growth(self, state: FilmHistory) -> Array:
        """Ratio of the shear in `state` to the shear without history, (n,)."""


GrowingLoads = TypeVar("GrowingLoads", bound=Growing)


class OnNodes(NamedTuple):
    """Data of this rank's nodes.

    They are: a mask of covered nodes; the loads without history; the pressure where a node is in
    contact, Pa; the cell mean of a value of the points.
    """

    covered: Mask
    loads: FilmLoads
    pressure: Array
    mean: Array


class FilmsBelowHistory(FilmsOnNodes[GrowingLoads]):
    """Films on the ice's nodes with a contact history."""

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """Shear under the films around each point. Collective."""
        _, loads = self.on_nodes(contact)
        shearing = np.exp(log_shearing(state))
        here, grown = (
            self.at_points(values, contact) for values in (shearing, loads.growth(state) * shearing)
        )
        internal = self.internal_at_points(self._of_film(state), contact)
        touching = self._law.read(here, internal, contact.speed)
        growth = grown / here

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            factor = growth.reshape(pressure.shape)
            tau, by_pressure, by_speed = touching(pressure, speed)
            return factor * tau, factor * by_pressure, factor * by_speed

        return shear

    def _of_film(self, state: InterfaceState) -> InterfaceState:
        """`state` with only the internal variables of the film."""
        return state

    def _scattered(
        self, contact: ContactLoads, loads: FilmLoads, pressure: Array, value: Array
    ) -> OnNodes:
        """Loads, pressures (Pa) and `value` (n,) of the points, averaged to the nodes.
        Collective.
        """
        grid, touching = self.ice.grid, contact.touching
        amounts = np.stack([touching, touching * pressure, touching * value])
        area, force, amount = grid.scatter(amounts, place(grid, contact))[:, grid.own]
        covered, of_nodes = self._of_nodes(loads, contact)
        mean_pressure = np.divide(force, area, out=np.zeros_like(force), where=covered)
        return OnNodes(covered, of_nodes, mean_pressure, amount / grid.cell_area[grid.own])


class AgedOnIce(FilmsBelowHistory[AgedLoads]):
    """The age is the time for which a piece of ice has been below the rubber."""

    _law: AgedFilm

    def _of_film(self, state: InterfaceState) -> InterfaceState:
        return state._replace(internal=state.internal[: -self._law.age.rows])

    def _found_on_nodes(self, contact: ContactLoads) -> tuple[Mask, AgedLoads]:
        loads = self._law.loads(contact.pressure, contact.speed)
        covered, touching, pressure, mean = self._scattered(
            contact, loads.touching, loads.pressure, loads.pressure
        )
        return covered, loads._replace(touching=touching, pressure=pressure, mean=mean)


class CarryingOnIce(FilmsBelowHistory[CarryingLoads]):
    """The water in the voids stays with the ice."""

    _law: CarryingFilm

    def _of_film(self, state: InterfaceState) -> InterfaceState:
        return state._replace(internal=state.internal[:0])

    def _brought(self, x: Array) -> Array:
        return self._law.brought(x)

    def _found_on_nodes(self, contact: ContactLoads) -> tuple[Mask, CarryingLoads]:
        loads = self._law.loads(contact.pressure, contact.speed)
        covered, touching, pressure, cover = self._scattered(
            contact, loads.touching, loads.pressure, loads.cover
        )
        return covered, loads._replace(touching=touching, pressure=pressure, cover=cover)
