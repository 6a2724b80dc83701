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
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.interface.on_ice import FilmsOnNodes, Nodal
from iceslide_fem.interface.window import place
from iceslide_fem.laws.aged_film import AgedFilm
from iceslide_fem.laws.carrying_film import CarryingFilm
from iceslide_fem.laws.interface_law import Sheared
from iceslide_fem.runtime.arrays import Array, Mask


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
