"""Heat conduction in the meshed ice below the contact: the `continuum` model.

The contact points lie anywhere on the ice's surface. Every rank knows the surface's grid: points
read their temperature from it by (bi)linear interpolation, and give their heat to the same nodes
with the same weights. All heat that leaves the interface enters the ice.

The ice is a `Column` below every node of the grid, with lateral conduction between columns. Its
modes are products of the column's modes and of lateral modes (`ice_modes`). The heat state is the
modal amplitudes, which all ranks hold. Each mode decays exactly over a step. In an implicit stage
the surface temperature is an offset plus a known, symmetric response to the heat of the nodes. Only
the film on the surface has to be iterated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.law import Film, FilmStage
from iceslide_fem.interface.film_frame import Unmeshed
from iceslide_fem.interface.ice_modes import StageSurface, SurfaceModes
from iceslide_fem.interface.ice_surface import IceSurface
from iceslide_fem.interface.surface_grid import Contacts, Profile, SurfaceGrid
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.runtime.arrays import Array


class Continuum(Unmeshed):
    """Heat equation in the ice below a grid on its surface.

    grid: of the surface; the ranks share its `nodes` evenly. Heat state: lateral amplitudes of the
    column's modal amplitudes (J/m2, see `Column`), (n_modes, *shape of the grid), on all ranks. The
    sides are insulated.
    """

    def __init__(
        self,
        surface: Sequence[Lines],
        comm: MPI.Comm,
        column: Column,
        interface_resistance: float,
        agreement: float,
    ) -> None:
        """Ice with a `column` below each node of the grid of `surface` lines in x (and y), m.

        interface_resistance: resistance between points and ice, as a fraction of the column's. With
        it the flux of a melting point is a unique function of its temperature. It is equal in all
        stages, so a point held at T_m in one stage is at T_m in the next. agreement: largest
        difference (K) of nodal temperatures from the response to the points' heat; no heat is lost.
        """
        self._column, self._solid = column, column.solid
        self._weights = column.surface**2
        self.interface_resistance = (
            interface_resistance * float(column.depths[-1]) / self._solid.conductivity
        )
        self._agreement = agreement
        self.modes = SurfaceModes(surface)
        self.rates = np.add.outer(column.rates, self._solid.diffusivity * self.modes.rates)
        self.grid = SurfaceGrid.shared(surface, comm)
        self.nodes = self.grid.nodes
        self._surface = IceSurface(self.grid, self._solid, self.modes)

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns on all ranks: nodes of the mesh. The modes are fewer."""
        return self.grid.n_nodes * self._column.depths.size

    def initial(self, n_points: int) -> Array:
        """Heat state of ice at its initial temperature (whatever the number of points)."""
        return np.zeros(self.rates.shape)

    def under(self, contacts: Contacts) -> Continuum:
        """The thermal response of this ice below `contacts`. Collective."""
        below = copy(self)
        below._surface = self._surface.under(contacts)
        return below

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature at the points (K), shape (n,)."""
        return self.grid.interpolate(self._at_surface(heat_state).ravel(), self._surface.at)

    def shifted(self, heat_state: Array, cells: int, ahead: Array) -> Array:
        """Heat state after the window has moved `cells` cells in +x over ice `ahead`."""
        columns, moved = self.modes.values(heat_state), self.modes.values(ahead)
        moved[:, : columns.shape[1] - cells] = columns[:, cells:]
        return self.modes.amplitudes(moved)

    def alike(self, heat_state: Array, line: int) -> Array:
        """Heat state of ice that is everywhere along x as at a `line` of the grid."""
        columns = self.modes.values(heat_state)
        columns[:] = columns[:, line : line + 1]
        return self.modes.amplitudes(columns)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """Solve capacity (T - T_start) / dt + conduction T = heat from the film. Collective.

        Raises NotConverged.
        """
        decay = np.reciprocal(1.0 + dt * self.rates)
        cooled = start * decay
        stage = StageSurface(self._at_surface(cooled), dt * self._per_heat(decay))
        before = self._at_surface(start)
        given, result = self._surface.solve(
            stage, before, film, self.interface_resistance, self._agreement
        )
        return cooled + dt * self.modes.load_amplitudes(given) * decay, result

    def heat(self, heat_state: Array) -> float:
        """Heat above the initial temperature, J (J/m in a slice)."""
        return float(self._column.heat(self._columns(heat_state)) @ self.grid.cell_area)

    def profile(self, heat_state: Array) -> Profile:
        """Temperature and heat below the nodes of the grid."""
        column, columns = self._column, self._columns(heat_state)
        kelvin, heat = column.at_depths(columns), column.heat(columns)
        return Profile(column.depths, kelvin, heat, self.grid)

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays of the column: T - T_0 below this rank's surface nodes."""
        return self._column.saved(self._columns(heat_state)[:, self.grid.own])

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays; ice below a shallower one is cold. Collective."""
        columns = self.grid.allgather(self._column.restored(saved))
        return self.modes.amplitudes(columns.reshape(self.rates.shape))

    def _columns(self, heat_state: Array) -> Array:
        """Heat state of the column below each node of the surface, (n_modes, nodes)."""
        return self.modes.values(heat_state).reshape(len(heat_state), -1)

    def _per_heat(self, heat_state: Array) -> Array:
        """Surface temperature rise of `heat_state` (n_modes, ...), K, (...)."""
        shape = heat_state.shape[1:]
        return np.asarray(self._weights @ heat_state.reshape(self._weights.size, -1)).reshape(shape)

    def _at_surface(self, heat_state: Array) -> Array:
        """Temperature (K) at the surface's nodes, shaped as the grid."""
        return self._column.temperature + self.modes.values(self._per_heat(heat_state))
