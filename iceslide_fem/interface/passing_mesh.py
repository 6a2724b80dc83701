"""Meshed sliding ice: a window of equal cells that shifts by whole cells.

The unknowns of the surface are the nodes of the window's grid, on which films or points lie.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.heat.elements import product
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.exchange import numbers_at, taking
from iceslide_fem.heat.surface import Reading, Readings
from iceslide_fem.interface.ice_mesh import MeshedIce, Settings
from iceslide_fem.interface.rubber_mesh import MeshedIceAndRubber, MeshedRubber
from iceslide_fem.interface.surface_grid import Placement, Profile, SurfaceGrid
from iceslide_fem.runtime.arrays import Array


class _Passing(MeshedIce):
    """Ice below the nodes of a `grid` on its surface, whose first axis has equal cells."""

    grid: SurfaceGrid

    def window(self, grid: SurfaceGrid) -> None:
        """Set the window to this `grid`. Collective."""
        self.grid, equation = grid, self.equation
        along = grid.lines[0]
        ahead = equation.x + np.eye(1, equation.x.shape[1]) * (along[1] - along[0])
        self._shift = taking(equation, numbers_at(equation, ahead))
        axes = np.meshgrid(*grid.lines, indexing="ij")
        nodes = np.stack([axis.ravel()[grid.own] for axis in axes], axis=1)
        number, weight = self._surface.read(nodes)
        own = np.take_along_axis(number, weight.argmax(axis=1)[:, None], axis=1)[:, 0]
        self._numbers = np.rint(grid.allgather(own.astype(float))).astype(np.int64)
        of_nodes = self._bodies.joint(0, Reading(own[:, None], np.ones((own.size, 1))))
        self._of_nodes = Readings(self._bodies.reading(of_nodes))

    def unknowns(self, at: Placement) -> Reading:
        """Interpolation to points placed `at` on the grid, whose nodes are unknowns."""
        return Reading(self._numbers[at.node], at.weight)

    def profile(self, heat_state: Array) -> Profile:
        """Temperature of the surface's nodes, and heat below them. Collective."""
        grid, ice = self.grid, self.equation
        rise = grid.allgather(self._of_nodes.of(self._bodies.rise(heat_state)))
        heat = np.where(ice.held, 0.0, ice.capacity * self._bodies.parts(heat_state)[0])
        below = grid.scatter(heat, grid.place(ice.x[:, :-1])) / grid.cell_area
        return Profile(np.zeros(1), self._settings.temperature + rise[None], below, grid)

    def shifted(self, heat_state: Array, cells: int, ahead: Array) -> Array:
        """Heat state after the window moves `cells` cells in +x over ice `ahead`. Collective."""
        ice, *others = self._bodies.parts(heat_state)
        enters = self._bodies.parts(ahead)[0]
        for _ in range(cells):
            ice = enters + product(self._shift, ice - enters)
        return np.concatenate([ice, *others])

    def alike(self, heat_state: Array, line: int) -> Array:
        """Heat state of ice that is everywhere along x as at a `line` of the grid. Collective."""
        ice, *others = self._bodies.parts(heat_state)
        places = self.equation.x.copy()
        places[:, 0] = self.grid.lines[0][line]
        copied = taking(self.equation, numbers_at(self.equation, places))
        return np.concatenate([product(copied, ice), *others])


class PassingMeshedIce(_Passing):
    """Meshed sliding ice. Heat state: as of `MeshedIce`."""

    def __init__(self, equation: HeatEquation, grid: SurfaceGrid, settings: Settings) -> None:
        """As `MeshedIce`, with the window's `grid`. Collective."""
        super().__init__(equation, settings)
        self.window(grid)


class PassingMeshedIceAndRubber(_Passing, MeshedIceAndRubber):
    """Meshed sliding ice and meshed rubber. Heat state: as of `MeshedIceAndRubber`."""

    def __init__(
        self, ice: HeatEquation, rubber: MeshedRubber, grid: SurfaceGrid, settings: Settings
    ) -> None:
        """As `MeshedIceAndRubber`, with the window's `grid`. Collective."""
        super().__init__(ice, rubber, settings)
        self.window(grid)
