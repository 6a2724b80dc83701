"""Heat in the rubber above films on the ice: points move over nodes."""

from __future__ import annotations

from copy import copy

import numpy as np

from iceslide_fem.film.film_between import WATER_FILM, HalfFilm, RubberSurface
from iceslide_fem.film.rubber_heat import Insulated, RubberColumns
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.interface.surface_grid import Contacts, SurfaceGrid
from iceslide_fem.interface.window import passed_over
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MELTING_TEMPERATURE, Solid


class InsulatedOverGrid(Insulated):
    """Rubber that takes no heat, above films on the ice."""

    def above(self, start: ContactLoads, end: ContactLoads) -> InsulatedOverGrid:
        """The same."""
        return self


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
