"""Heat conduction in the meshed ice below the contact: the `continuum` model.

The contact points lie anywhere on the ice's surface. Every rank knows the surface's grid: points
read their temperature from it by (bi)linear interpolation and give their heat to the same nodes
with the same weights, so that the heat that leaves the interface is the heat that enters the ice.

The mesh is a tensor grid, so that its modes are products of those of lines (`ice_modes`). The
content is the modes' amplitudes, which all ranks have: between two steps nothing but their decay
has to be found. Within an implicit stage the surface's temperatures are an offset and a known,
symmetric response to the heat that they are given; what has to be iterated is the film on the
surface alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.interface.ice_modes import GridModes, line_matrices
from iceslide_fem.interface.ice_surface import UNSETTLED, Balance, Fluxes, StageSurface
from iceslide_fem.interface.surface_grid import Contacts, Profile, SurfaceGrid
from iceslide_fem.materials import ICE, Solid
from iceslide_fem.mesh.grid import Lines

# Where it melts, the surface is held at T_m through a resistance of this share of the first
# layer's: the flux is then a function of the point's temperature, and unique.
RESISTANCE_SHARE = 1e-3
AGREEMENT = 1e-6  # K, with which the film is content when it is asked again
# Full changes find what films give in a few iterations; where they cycle, half of each does.
FULL_ITERATIONS, MAX_ITERATIONS = 12, 60


class Continuum:
    """Heat equation on the ice mesh, linear elements; content: amplitudes of T - T_0, on all ranks.

    grid: that of the surface, whose `nodes` the ranks share evenly. T_0 in K.
    """

    def __init__(
        self, lines: Sequence[Lines], comm: MPI.Comm, temperature: float, solid: Solid = ICE
    ) -> None:
        """Ice at `temperature` (K) on the grid `lines` of x, (y,) z, m, without points yet."""
        self._initial, self._solid = temperature, solid
        self._shape = tuple(line.size for line in lines)
        self._modes = GridModes(lines)
        self._volumes = [line_matrices(line)[0].sum(axis=1) for line in lines]
        surface = np.arange(int(np.prod(self._shape[:-1])))
        own = np.array_split(surface, comm.size)[comm.rank]
        self.grid = SurfaceGrid(lines[:-1], own, comm)
        self.nodes = self.grid.nodes
        z = lines[-1]
        self._depths = -z[::-1]  # of the nodes, from 0 downwards, m
        self._link = RESISTANCE_SHARE * float(z[-1] - z[-2]) / solid.conductivity
        self._contacts = Contacts(self.grid.own_nodes(), np.zeros(own.size))

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns on all ranks."""
        return int(np.prod(self._shape))

    def initial(self, n_points: int) -> Array:
        """Content of ice at its initial temperature (whatever the number of points)."""
        return np.zeros(self._shape)

    def under(self, contacts: Contacts) -> Continuum:
        """The same ice as it answers below `contacts`."""
        below = copy(self)
        below._contacts = contacts
        return below

    def content(self, rise: Array) -> Array:
        """Content of T - T_0 (K) at the nodes, of the grid's shape, z upwards."""
        return self._modes.amplitudes(rise)

    def rise(self, content: Array) -> Array:
        """T - T_0 (K) at the nodes, of the grid's shape, z upwards."""
        return self._modes.nodal(content)

    def surface_temperature(self, content: Array) -> Array:
        """Temperature at the points (K), shape (n,)."""
        return self.grid.interpolate(self._at_surface(content).ravel(), self._contacts.at)

    def shifted(self, content: Array, cells: int) -> Array:
        """Content after the window has moved `cells` cells in +x: fresh ice enters."""
        rise = self.rise(content)
        moved = np.zeros_like(rise)
        moved[: rise.shape[0] - cells] = rise[cells:]
        return self.content(moved)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """Solve capacity (T - T_start) / dt + conduction T = heat from the film. Collective.

        Where a point melts (or the rubber takes heat, too), its flux depends on the temperature:
        ice and the film's `Fluxes` are balanced, and the film is asked again at the temperatures
        found. Raises NotConverged.
        """
        modes, (at, area) = self._modes, self._contacts
        per_heat = float(dt) / (self._solid.density * self._solid.heat_capacity)
        decay = np.reciprocal(1.0 + float(dt) * self._solid.diffusivity * modes.rates)
        cooled = start * decay
        resistance = per_heat * (decay @ modes.surface**2)
        surface = StageSurface(self.grid, modes, at, self._at_surface(cooled), resistance)

        def warmed(balance: Balance) -> Array:
            heat = per_heat * modes.load_amplitudes(balance.given)
            return cooled + heat[..., None] * (modes.surface * decay)

        temperature = self._at_surface(start)
        below = self.grid.interpolate(temperature.ravel(), at)
        link, T_m = np.full(area.shape, self._link), self._solid.melting_temperature
        near = None
        for iteration in range(MAX_ITERATIONS):
            result = film.solve(Surface.of(below, link, self._solid), near)
            near = result.log_height
            balance = surface.balance(temperature, below, area * result.ice_flux)
            if np.abs(surface.residual(balance)).max() <= AGREEMENT:
                return warmed(balance), result
            fluxes = Fluxes.of(result, below, area, self._link, T_m)
            balance, depends = surface.balanced(balance, fluxes)
            if not depends:  # the film would say the same again, but for this
                dry = result.dry_temperature + (balance.below - below)
                return warmed(balance), result._replace(dry_temperature=dry)
            share = 1.0 if iteration < FULL_ITERATIONS else 0.5
            temperature = temperature + share * (balance.temperature - temperature)
            below = below + share * (balance.below - below)
        raise NotConverged(UNSETTLED)

    def heat(self, content: Array) -> float:
        """Heat above the initial temperature, J (J/m in a slice)."""
        total = self.rise(content)
        for volumes in self._volumes:
            total = np.tensordot(volumes, total, axes=(0, 0))
        return float(self._solid.density * self._solid.heat_capacity * total)

    def profile(self, content: Array) -> Profile:
        """Temperature and heat below the nodes of the grid."""
        rise = self._below(content)
        capacity = self._solid.density * self._solid.heat_capacity
        heat = capacity * self._volumes[-1][::-1] @ rise
        return Profile(self._depths, self._initial + rise, heat, self.grid)

    def saved(self, content: Array) -> dict[str, Array]:
        """What checkpoints keep: T - T_0 below this rank's nodes of the surface."""
        return {"rise": self._below(content)[:, self.grid.own]}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Content of what was `saved`, also by ice that ended higher: below is cold. Collective."""
        rise = np.zeros((self._shape[-1], self.grid.n_nodes))
        rise[: len(saved["rise"])] = self.grid.allgather(saved["rise"])
        return self.content(rise[::-1].T.reshape(self._shape))

    def _at_surface(self, content: Array) -> Array:
        """Temperature (K) at the surface's nodes, of its shape."""
        modes = self._modes
        return self._initial + modes.surface_values(content @ modes.surface)

    def _below(self, content: Array) -> Array:
        """T - T_0 (K) at the depths below all nodes of the surface, (depths, nodes)."""
        return self.rise(content).reshape(-1, self._shape[-1]).T[::-1]
