"""Ice in columns: below each point of the rubber where it is attached, on a grid where it passes.

Longitudinal conduction is negligible at the Peclet numbers of a tread block (thousands), so every
node of the surface has its own column, which is carried along with the passing ice.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy

import numpy as np
from scipy.linalg import solveh_banded

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column, IceHeat
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.interface.line_search import search
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Profile, SurfaceGrid
from iceslide_fem.interface.window import shifted
from iceslide_fem.materials import ICE, Solid

# Where points of the rubber carry the film, each is joined to the columns through this share of
# a column's resistance: its flux is then a function of its temperature, and unique.
RESISTANCE_SHARE = 1e-3
MAX_ITERATIONS = 50
TEMPERATURE_TOLERANCE = 1e-7  # K


class OwnColumns:
    """Every point of the rubber has ice of its own: `model` below each; content: the model's."""

    nodes: OwnNodes | None = None  # the points hold the content
    n_dofs = 0  # of a mesh

    def __init__(self, model: Column | HalfSpace) -> None:
        self._model = model

    def initial(self, n_points: int) -> Array:
        """Cold ice below each point."""
        return self._model.initial(n_points)

    def under(self, contacts: Contacts) -> IceHeat:
        """The ice below the points, wherever they lie."""
        return self._model

    def saved(self, content: Array) -> dict[str, Array]:
        """The model's, at the points."""
        return self._model.saved(content)

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """The model's."""
        return self._model.restored(saved)

    def profile(self, content: Array) -> Profile | None:
        """Temperature and heat below the points; of the closed form none is known."""
        if not isinstance(self._model, Column):
            return None
        column = self._model
        return Profile(column.depths, column.at_depths(content), column.heat(content), None)


class GridColumns(Column):
    """Columns below this rank's nodes of `grid`, heated by films on the nodes themselves.

    Content: amplitudes (n_modes, own nodes).
    """

    n_dofs = 0  # of a mesh

    def __init__(
        self, grid: SurfaceGrid, temperature: float, duration: float | Array, solid: Solid = ICE
    ) -> None:
        """Ice at `temperature` (K); `duration` (s) that any of it is heated or watched."""
        super().__init__(temperature, duration, solid=solid)
        self.grid = grid
        self.nodes = grid.nodes

    def under(self, contacts: Contacts) -> GridColumns:
        """The same: the films lie on the nodes."""
        return self

    def profile(self, content: Array) -> Profile:
        """Temperature and heat below the nodes of the grid. Collective."""
        kelvin, heat = (
            self.grid.allgather(own) for own in (self.at_depths(content), self.heat(content))
        )
        return Profile(self.depths, kelvin, heat, self.grid)

    def initial(self, n_points: int) -> Array:
        """Cold ice below this rank's nodes, whatever the number of points."""
        return super().initial(self.grid.own.size)

    def shifted(self, content: Array, cells: int) -> Array:
        """Content after the window has moved `cells` cells in +x: fresh ice enters. Collective."""
        return shifted(self.grid, content, cells)


class GridColumnsUnderPoints(GridColumns):
    """Columns below a surface grid, heated by films on points that move over it.

    Points share the columns around them, so their fluxes are found together.
    """

    def __init__(
        self, grid: SurfaceGrid, temperature: float, duration: float | Array, solid: Solid = ICE
    ) -> None:
        """As `GridColumns`, without points yet."""
        super().__init__(grid, temperature, duration, solid)
        self._contacts = Contacts(grid.own_nodes(), np.zeros(grid.own.size))

    def under(self, contacts: Contacts) -> GridColumnsUnderPoints:
        """The same ice as it answers below `contacts`."""
        below = copy(self)
        below._contacts = contacts
        return below

    def surface_temperature(self, content: Array) -> Array:
        """Temperature at the points (K), shape (n,). Collective."""
        own = super().surface_temperature(content)
        return self.grid.interpolate(self.grid.allgather(own), self._contacts.at)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """One implicit stage by Newton's method on the columns' temperatures. Collective.

        Raises NotConverged if the set of melting points does not settle.
        """
        grid, (at, area) = self.grid, self._contacts
        offset = grid.allgather(self.response(start, dt).offset)
        resistance = self.resistance(dt)  # one for all
        per_heat = resistance / grid.cell_area
        link = np.full(area.shape, RESISTANCE_SHARE * float(resistance[0]))
        temperature = grid.allgather(GridColumns.surface_temperature(self, start))
        matrix = np.zeros((grid.diagonals[-1] + 1, grid.n_nodes))  # diagonals, lower half

        def balance(trial: Array, near: Array | None) -> tuple[Array, FilmStage, Array]:
            """A temperature of the nodes, the films above it, and the heat that they give (W)."""
            result = film.solve(Surface.of(grid.interpolate(trial, at), link, self.solid), near)
            return trial, result, grid.scatter(area * result.ice_flux, at)

        temperature, result, heat = balance(temperature, None)
        for _ in range(MAX_ITERATIONS):
            residual = (temperature - offset) / per_heat - heat
            if not np.isfinite(residual).all():
                break
            if np.abs(per_heat * residual).max() <= TEMPERATURE_TOLERANCE:
                flux = heat[grid.own] / grid.cell_area[grid.own]
                return self.heated(start, dt, dt * flux), result
            matrix[grid.diagonals] = grid.coupling(area * result.ice_slope / link, at)
            matrix[0] += 1.0 / per_heat
            change, before = -solveh_banded(matrix, residual, lower=True), temperature

            def slope_at(share: float, before: Array = before, change: Array = change) -> float:
                nonlocal temperature, result, heat
                trial = before + share * change
                temperature, result, heat = balance(trial, result.log_height)
                return float(change @ ((temperature - offset) / per_heat - heat))

            search(slope_at, float(change @ residual))
        raise NotConverged("the melting part of the ice's surface does not settle")
