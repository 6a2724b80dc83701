"""Meshed ice that passes under the block: a window of equal cells that is shifted by whole ones.

The unknowns of the surface are the nodes of the window's grid, which has the films or the points.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import PETSc
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.exchange import numbers_at, taking
from iceslide_fem.heat.matrices import product, rows_of
from iceslide_fem.interface.ice_mesh import MeshedIce, Settings
from iceslide_fem.interface.surface_grid import Contacts, Placement, Profile, SurfaceGrid


class PassingMeshedIce(MeshedIce):
    """Ice below the nodes of a `grid` on its surface. Content: as that of `MeshedIce`."""

    def __init__(
        self,
        equation: HeatEquation,
        grid: SurfaceGrid,
        settings: Settings,
    ) -> None:
        """As `MeshedIce`, below a `grid` whose first axis has equal cells. Collective."""
        super().__init__(equation, settings)
        self.grid = grid
        along = grid.lines[0]
        ahead = equation.x + np.eye(1, equation.x.shape[1]) * (along[1] - along[0])
        self._shift = taking(equation, numbers_at(equation, ahead))
        axes = np.meshgrid(*grid.lines, indexing="ij")
        nodes = np.stack([axis.ravel()[grid.own] for axis in axes], axis=1)
        self._of_nodes = self._bodies.reading(self._surface.read(nodes))

    def profile(self, content: Array) -> Profile:
        """Temperature of the surface's nodes, and heat below them. Collective."""
        grid, x = self.grid, self.equation.x
        own = self.under(Contacts(grid.own_nodes(), grid.cell_area[grid.own]))
        kelvin = grid.allgather(own.surface_temperature(content))
        heat = np.where(self.equation.held, 0.0, self.equation.capacity * content)
        below = grid.scatter(heat, grid.place(x[:, :-1])) / grid.cell_area
        return Profile(np.zeros(1), kelvin[None], below, grid)

    def shifted(self, content: Array, cells: int) -> Array:
        """Content after the window has moved `cells` cells in +x: fresh ice enters. Collective."""
        fresh = self._bodies.initial()
        for _ in range(cells):
            content = fresh + product(self._shift, content - fresh)
        return content

    def _reading(self, at: Placement) -> PETSc.Mat:
        """By way of the grid's nodes, on which points lie."""
        numbers = at.node.astype(np.int64)
        on_grid = rows_of(numbers, at.share, self.grid.own.size, self.grid.comm)
        reads = on_grid.matMult(self._of_nodes)
        on_grid.destroy()
        return reads
