"""Heat in the rubber above films that live on the ice: points and nodes move past each other."""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.film.rubber_heat import RubberColumns, RubberSurface
from iceslide_fem.interface.surface_grid import SurfaceGrid


class RubberOverGrid(RubberColumns):
    """Columns of rubber at contact points that move over films on the nodes of the ice.

    `at` places the points on the `grid`, `area` (n,) is what each covers, m2 (m in a slice), 0
    where it has no contact. A node sees the mean temperature of the points around it, and they
    take its heat with the same weights, so that none is lost or made on the way.
    """

    def __init__(
        self,
        grid: SurfaceGrid,
        temperature: float,
        duration: float,
        density: float,
        conductance: float | None = None,
    ) -> None:
        """As `RubberColumns`, without points yet."""
        super().__init__(temperature, duration, density, conductance)
        self.grid = grid
        self.at, self.area = grid.own_nodes(), np.zeros(grid.own.size)

    def response(self, start: Array, dt: Array | float) -> RubberSurface:
        """The rubber's surface over this rank's nodes at the end of a stage. Collective.

        The points around a node answer as if each took the node's own flux, not the mean of its
        neighbours' fluxes.
        """
        decay = self.column.decay(dt)
        mean = self._mean(self.column.response(start, decay, dt).offset)
        resistance = self.column.resistance(decay, dt)  # one for all
        return RubberSurface(mean, resistance, self._cover(), self.conductance)

    def heated(self, start: Array, dt: Array | float, flux: Array) -> Array:
        """Content after a stage with `flux` (W/m2) at this rank's nodes. Collective."""
        cover = self._cover()
        at_contact = np.divide(flux, cover, out=np.zeros_like(flux), where=cover > 0.0)
        at_points = self.grid.interpolate(self.grid.allgather(at_contact), self.at)
        return super().heated(start, dt, np.where(self.area > 0.0, at_points, 0.0))

    def surface_temperature(self, content: Array) -> Array:
        """Mean temperature over this rank's nodes (K). Collective."""
        return self._mean(super().surface_temperature(content))

    def _mean(self, values: Array) -> Array:
        """Mean over the points around each of this rank's nodes; T_0 where there are none."""
        area, amount = self.grid.scatter(np.stack([self.area, self.area * values]), self.at)
        mean = np.full_like(area, float(self.column.temperature))
        np.divide(amount, area, out=mean, where=area > 0.0)
        return np.asarray(mean[self.grid.own])

    def _cover(self) -> Array:
        """Share of the cells of this rank's nodes that is in contact."""
        area = self.grid.scatter(self.area, self.at) / self.grid.cell_area
        return np.asarray(area[self.grid.own])
