"""Ice in columns: below each point of the rubber (attached ice), or on a grid (sliding ice).

Longitudinal conduction is negligible at the Peclet numbers of a tread block (thousands), so every
node of the surface has its own column. The column moves with the sliding ice.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy

import numpy as np

from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column, IceHeat
from iceslide_fem.film.law import Film, FilmStage
from iceslide_fem.interface.film_frame import Unmeshed
from iceslide_fem.interface.ice_modes import StageSurface
from iceslide_fem.interface.ice_surface import IceSurface
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Profile, SurfaceGrid
from iceslide_fem.interface.window import alike, shifted
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BOTTOMLESS, ICE, Ground, Solid

# If films are on the rubber, each point is coupled to the columns through this fraction of a
# column's resistance. The flux is then a unique function of the point's temperature.
INTERFACE_RESISTANCE = 1e-3
AGREEMENT = 1e-7  # K, between points and columns


class OwnColumns(Unmeshed):
    """Separate ice of one `model` below each point of the rubber. Heat state: the model's."""

    nodes: OwnNodes | None = None  # the points hold the heat state

    def __init__(self, model: Column | HalfSpace) -> None:
        self._model = model

    def initial(self, n_points: int) -> Array:
        """Cold ice below each point."""
        return self._model.initial(n_points)

    def under(self, contacts: Contacts) -> IceHeat:
        """The ice below the points, independent of their positions."""
        return self._model

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays of the model, at the points."""
        return self._model.saved(heat_state)

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state of the model."""
        return self._model.restored(saved)

    def profile(self, heat_state: Array) -> Profile | None:
        """Temperature and heat below the points; None for the closed form."""
        if not isinstance(self._model, Column):
            return None
        column = self._model
        return Profile(column.depths, column.at_depths(heat_state), column.heat(heat_state), None)


class GridColumns(Unmeshed, Column):
    """Columns below this rank's nodes of `grid`, heated by films on the nodes themselves.

    Heat state: amplitudes (n_modes, own nodes).
    """

    def __init__(
        self,
        grid: SurfaceGrid,
        temperature: float,
        duration: float | Array,
        solid: Solid = ICE,
        ground: Ground = BOTTOMLESS,
    ) -> None:
        """Ice at `temperature` (K); `duration` (s): time for which it is heated or observed."""
        super().__init__(temperature, duration, solid=solid, ground=ground)
        self.grid = grid
        self.nodes = grid.nodes

    def under(self, contacts: Contacts) -> GridColumns:
        """This object: the films lie on the nodes."""
        return self

    def profile(self, heat_state: Array) -> Profile:
        """Temperature and heat below the nodes of the grid. Collective."""
        kelvin, heat = (
            self.grid.allgather(own) for own in (self.at_depths(heat_state), self.heat(heat_state))
        )
        return Profile(self.depths, kelvin, heat, self.grid)

    def initial(self, n_points: int) -> Array:
        """Cold ice below this rank's nodes, whatever the number of points."""
        return super().initial(self.grid.own.size)

    def shifted(self, heat_state: Array, cells: int, ahead: Array) -> Array:
        """Heat state after the window moves `cells` cells in +x over ice `ahead`. Collective."""
        return shifted(self.grid, heat_state, cells, ahead)

    def alike(self, heat_state: Array, line: int) -> Array:
        """Heat state of ice that is everywhere along x as at a `line`. Collective."""
        return alike(self.grid, heat_state, line)


class GridColumnsUnderPoints(GridColumns):
    """Columns below a surface grid, heated by films on points that move over it.

    Points share the columns around them, so their fluxes are solved together.
    """

    def __init__(
        self,
        grid: SurfaceGrid,
        temperature: float,
        duration: float | Array,
        solid: Solid = ICE,
        ground: Ground = BOTTOMLESS,
    ) -> None:
        """As `GridColumns`, without points yet."""
        super().__init__(grid, temperature, duration, solid, ground)
        self._surface = IceSurface(grid, solid)

    def under(self, contacts: Contacts) -> GridColumnsUnderPoints:
        """The thermal response of this ice below `contacts`. Collective."""
        below = copy(self)
        below._surface = self._surface.under(contacts)
        return below

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature at the points (K), shape (n,). Collective."""
        return self.grid.interpolate(self._of_nodes(heat_state), self._surface.at)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """One implicit stage of all columns together. Collective. Raises NotConverged."""
        grid, resistance = self.grid, float(self.resistance(dt)[0])  # equal in all columns
        offset = grid.allgather(self.response(start, dt).offset)
        stage = StageSurface(offset, np.full(grid.n_nodes, resistance))
        interface_resistance = INTERFACE_RESISTANCE * resistance
        given, result = self._surface.solve(
            stage, self._of_nodes(start), film, interface_resistance, AGREEMENT
        )
        return self.heated(start, dt, dt * (given / grid.cell_area)[grid.own]), result

    def _of_nodes(self, heat_state: Array) -> Array:
        """Temperature (K) of all nodes. Collective."""
        return self.grid.allgather(super().surface_temperature(heat_state))
