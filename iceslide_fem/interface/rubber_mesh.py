"""Heat in the rubber's mesh, of any shape, in one balance with meshed ice.

The rubber conducts in its reference configuration, in the quadratic elements of its displacements.
The films between it and the ice conduct to either body; its plate is insulated or held.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.rubber_heat import (
    WATER_FILM,
    HalfFilm,
    Insulated,
    RubberColumns,
    RubberSurface,
)
from iceslide_fem.heat.balance import BetweenIceAndRubber, Meeting
from iceslide_fem.heat.elements import QuadraticElements
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.surface import Reading, Readings
from iceslide_fem.interface.film_frame import ContactLoads, Rises
from iceslide_fem.interface.ice_mesh import MeshedIce, Settings
from iceslide_fem.interface.surface_grid import Contacts, SurfaceGrid
from iceslide_fem.interface.window import passed_over
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MELTING_TEMPERATURE, Solid


class InsulatedOverGrid(Insulated):
    """Rubber that takes no heat, above films on the ice."""

    def above(self, start: ContactLoads, end: ContactLoads) -> InsulatedOverGrid:
        """The same."""
        return self

    def at_points(self, heat_state: Array) -> None:
        """None: it has no temperature."""


class RubberOverGrid(RubberColumns):
    """Columns of rubber at contact points that move over films on the nodes of the ice.

    The rubber temperature at a node is the mean of the points around it. The points take the node's
    heat with the same weights, so heat is conserved.
    """

    def __init__(
        self,
        grid: SurfaceGrid,
        temperature: float,
        duration: float | Array,
        solid: Solid,
        half_film: HalfFilm = WATER_FILM,
        melting_temperature: float = MELTING_TEMPERATURE,
    ) -> None:
        """As `RubberColumns`, without points yet."""
        super().__init__(temperature, duration, solid, half_film, melting_temperature)
        self.grid = grid
        self._contacts = Contacts(grid.own_nodes(), np.zeros(grid.own.size))

    def above(self, start: ContactLoads, end: ContactLoads) -> RubberOverGrid:
        """The thermal response with the points' positions in a step from `start` to `end`."""
        over = copy(self)
        over._contacts = passed_over(self.grid, start, end)
        return over

    def response(self, start: Array, dt: Array | float) -> RubberSurface:
        """The rubber's surface over this rank's nodes at the end of a stage. Collective.

        Approximation: each point around a node takes this node's flux, not the mean flux of all
        nodes around the point.
        """
        mean = self._mean(self.column.response(start, dt).offset)
        resistance = self.column.resistance(dt)  # equal in all columns
        return RubberSurface(mean, resistance, self._node_cover(), self.half_film)

    def heated(self, start: Array, dt: Array | float, flux: Array) -> Array:
        """Heat state after a stage with `flux` (W/m2) at this rank's nodes. Collective."""
        cover, (at, area, _) = self._node_cover(), self._contacts
        at_contact = np.divide(flux, cover, out=np.zeros_like(flux), where=cover > 0.0)
        at_points = self.grid.interpolate(self.grid.allgather(at_contact), at)
        return super().heated(start, dt, np.where(area > 0.0, at_points, 0.0))

    def surface_temperature(self, heat_state: Array) -> Array:
        """Mean temperature over this rank's nodes (K). Collective."""
        return self._mean(super().surface_temperature(heat_state))

    def at_points(self, heat_state: Array) -> Array:
        """Surface temperature at the rubber's points, K."""
        return self.column.surface_temperature(heat_state)

    def _mean(self, values: Array) -> Array:
        """Mean over the points around each of this rank's nodes; T_0 without points."""
        at, own, _ = self._contacts
        area, amount = self.grid.scatter(np.stack([own, own * values]), at)
        mean = np.full_like(area, float(self.column.temperature))
        np.divide(amount, area, out=mean, where=area > 0.0)
        return np.asarray(mean[self.grid.own])

    def _node_cover(self) -> Array:
        """Contact fraction of the cell of each of this rank's nodes."""
        at, area, _ = self._contacts
        cover = self.grid.scatter(area, at) / self.grid.cell_area
        return np.asarray(cover[self.grid.own])


RAISED = 0.1  # m, above all ice


class MeshedRubber(NamedTuple):
    """Rubber that conducts heat in its mesh.

    It has a heat equation, the contact surface with the points, and the conductance of half a film.
    """

    equation: HeatEquation
    surface: ContactSurface
    half_film: HalfFilm


class MeshedIceAndRubber(MeshedIce):
    """Attached meshed ice and meshed rubber.

    Heat state: temperature rises of this rank's unknowns, first of ice, then of rubber, (n_own,),
    K.
    """

    def __init__(self, ice: HeatEquation, rubber: MeshedRubber, settings: Settings) -> None:
        """Bodies without points. Collective."""
        super().__init__(ice, settings, [rubber.equation])
        self.rubber, surface, self._half_film = rubber
        nodes = self.rubber.numbers[surface.dofs]
        f, q, a = surface.shape.shape
        number = np.broadcast_to(nodes[:, None], (f, q, a)).reshape(f * q, a)
        self._above = self._bodies.joint(1, Reading(number, surface.shape.reshape(f * q, a)))

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns of both on all ranks."""
        return self.equation.n_dofs + self.rubber.n_dofs

    def under(self, contacts: Contacts) -> MeshedIceAndRubber:
        """The thermal response of both bodies at `contacts`, all points. Collective."""
        below = copy(self)
        area, settings = contacts.area, self._settings
        contact = BetweenIceAndRubber(
            area, settings.solid, settings.interface_resistance, self._half_film
        )
        below._balance = self._balance.under(self._recent.of(contacts.at), contact)
        return below

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature of the ice at the points (K), shape (n,). Collective."""
        return np.asarray(np.split(super().surface_temperature(heat_state), 2)[0])

    def rubber_temperature(self, heat_state: Array) -> Array:
        """Temperature of the rubber at the points (K), shape (n,). Collective."""
        return np.asarray(np.split(super().surface_temperature(heat_state), 2)[1])

    @property
    def places(self) -> Array:
        """Positions of the unknowns of both, m. The rubber's are `RAISED`, so all are distinct."""
        above = self.rubber.x.copy()
        above[:, -1] += RAISED
        return np.concatenate([self.equation.x, above])

    def heat(self, heat_state: Array) -> float:
        """Heat of the ice above the initial temperature, J (J/m in a slice). Collective."""
        return self.equation.heat(self._bodies.parts(heat_state)[0])

    def rubber_heat(self, heat_state: Array) -> float:
        """Heat of the rubber above the initial temperature, J (J/m in a slice). Collective."""
        return self.rubber.heat(self._bodies.parts(heat_state)[1])

    def warmed(self, heat_state: Array, heat: Array) -> Array:
        """Heat state after `heat` (J; J/m in a slice) is added to the rubber. Collective.

        heat: this rank's part, at all local dofs of the rubber's space. Dofs at a held temperature
        ignore it.
        """
        ice, rubber = self._bodies.parts(heat_state)
        elements = self.rubber.elements
        assert isinstance(elements, QuadraticElements)  # by `heat_models.meshed_rubber`
        warmer = elements.summed(heat) / self.rubber.capacity
        return np.concatenate([ice, rubber + np.where(self.rubber.held, 0.0, warmer)])

    def rises(self, heat_state: Array) -> Rises:
        """Rises at the nodes of both. Collective."""
        ice, _ = self._bodies.parts(heat_state)
        return Rises(self.equation.nodal(ice), self.rubber_rise(heat_state))

    def rubber_rise(self, heat_state: Array) -> Array:
        """Rise (K) at all local dofs of the rubber's space, ghosts included. Collective."""
        return self.rubber.nodal(self._bodies.parts(heat_state)[1])

    def _met(self, below: Reading) -> Meeting:
        """Thermal contact of films and both bodies; `below`: interpolation from ice. Collective."""
        below = self._bodies.joint(0, below)
        widest = max(below.number.shape[1], self._above.number.shape[1])
        both = (_widened(one, widest) for one in (below, self._above))
        number, weight = (np.concatenate(parts) for parts in zip(*both, strict=True))
        reads = Readings(self._bodies.reading(Reading(number, weight)), bodies=2)
        return self._balance.meeting(reads, joins=True)


class RubberInMesh(Insulated):
    """The rubber of `MeshedIceAndRubber`, whose heat is in the state of the ice."""

    def at_contact(self, heat_state: Array, ice: IceHeat, of_ice: Array) -> Array | None:
        """Temperature of the rubber at the contact points, K. Collective."""
        assert isinstance(ice, MeshedIceAndRubber)
        return ice.rubber_temperature(of_ice)


def _widened(reading: Reading, nodes: int) -> Reading:
    """The same interpolation with `nodes` per point; added nodes have the weight 0."""
    missing = ((0, 0), (0, nodes - reading.number.shape[1]))
    return Reading(np.pad(reading.number, missing), np.pad(reading.weight, missing))
