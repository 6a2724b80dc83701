"""The surface of ice on a grid in an implicit stage, heated by points anywhere on it.

The iteration starts from the temperatures before the stage. The heat balance of points and ice is
solved (`ice_balance`), and the films are evaluated again, until both agree. Every rank does the
same computation for the points of all ranks.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.heat.newton import NOT_FOUND
from iceslide_fem.interface.ice_balance import Balance, Lines, balance
from iceslide_fem.interface.ice_modes import StageSurface, SurfaceConduction, SurfaceModes
from iceslide_fem.interface.surface_grid import (
    Contacts,
    Placement,
    Recent,
    SharedPoints,
    SurfaceGrid,
)
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged
from iceslide_fem.scene.materials import Solid

# Full updates converge in a few evaluations of the films. Half updates converge where full ones
# cycle.
FULL_CHANGES, MAX_REQUESTS = 12, 60


def fluxes(
    film: FilmStage, reference: Array, area: Array, interface_resistance: float, T_m: float
) -> Array:
    """Linearised heat (W) from points to ice, near `reference` temperatures (K) below them.

    The heat of a point is the smaller of two linear functions, each a heat at the reference minus
    its fall (W/K) times the rise (K): heat, fall, other heat, other fall, (n, 4). They are exact
    for a film of constant viscosity below insulated rubber. Such a film gives all its power, or the
    heat that holds the ice at T_m through the interface_resistance (K m2/W).
    """
    conductance, lines = area / interface_resistance, np.empty((area.size, 4))
    np.multiply(area, film.ice_flux, out=lines[:, 0])
    np.multiply(conductance, film.ice_slope, out=lines[:, 1])
    most = np.where(film.melting, film.dry_temperature, T_m)
    most -= reference
    np.multiply(conductance, most, out=lines[:, 2])
    np.multiply(conductance, ~film.melting, out=lines[:, 3])
    return lines


class IceSurface:
    """The surface of ice, and its response below points."""

    def __init__(self, grid: SurfaceGrid, solid: Solid, modes: SurfaceModes | None = None) -> None:
        """modes: None without lateral conduction along the `grid`. at: placement of its points,
        none at first. Collective.
        """
        self._grid, self._solid = grid, solid
        self._modes = modes
        self._recent: Recent[Placement, SharedPoints] = Recent(
            lambda at: SharedPoints(at, grid.shape, grid.comm), grid.comm
        )
        self._place(Contacts(grid.own_nodes(), np.zeros(grid.own.size)))

    def under(self, contacts: Contacts) -> IceSurface:
        """The same surface below `contacts`. Collective."""
        below = copy(self)
        below._place(contacts)
        return below

    def _place(self, contacts: Contacts) -> None:
        self.at, self._area = contacts.placed, contacts.area
        self.points = self._recent.of(contacts.at).among(contacts.points)

    def solve(
        self,
        stage: StageSurface,
        before: Array,
        film: Film,
        interface_resistance: float,
        agreement: float,
    ) -> tuple[Array, FilmStage]:
        """Heat from the points to the nodes (W, shaped as the stage), and the film. Collective.

        The flux of a point depends on the temperature if it melts or if the rubber takes heat. The
        heat balance of ice and `fluxes` is then solved, and the film is evaluated again at the new
        temperatures, until both agree within `agreement` (K). The first evaluation is at the
        temperatures `before` the stage.

        interface_resistance: between points and ice, K m2/W. Raises NotConverged.
        """
        grid, at, area, T_m = self._grid, self.at, self._area, self._solid.melting_temperature
        of_all, inside = self.points.of_all, self.inside(stage)
        temperature, near, resistances = before, None, np.full(area.shape, interface_resistance)
        below = grid.interpolate(temperature.ravel(), at)
        for iteration in range(MAX_REQUESTS):
            result = film.solve(Surface.of(below, resistances, self._solid), near)
            near = result.log_height
            lines = of_all(fluxes(result, below, area, interface_resistance, T_m))
            balance = self.balanced(inside, lines, temperature, agreement)
            if balance.converged:
                return balance.given, result
            damping = 1.0 if iteration < FULL_CHANGES or not balance.depends else 0.5
            temperature = temperature + damping * (balance.temperature - temperature)
            reference, below = below, grid.interpolate(temperature.ravel(), at)
            if not balance.depends:  # the film would not change, except for this
                dry = result.dry_temperature + (below - reference)
                return balance.given, result._replace(dry_temperature=dry)
        raise NotConverged(NOT_FOUND)

    def balanced(
        self, inside: SurfaceConduction, fluxes: Array, reference: Array, agreement: float
    ) -> Balance:
        """The balance with `fluxes` of all points (N, 4) around `reference` temperatures (K).

        See `ice_balance.balance`. Raises NotConverged.
        """
        return balance(inside, self.points, Lines(*fluxes.T), reference, agreement)

    def inside(self, stage: StageSurface) -> SurfaceConduction:
        """The surface in a stage, for `balanced`."""
        return SurfaceConduction(stage, self._grid.cell_area, self._grid.shape, self._modes)
