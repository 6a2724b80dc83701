"""The surface of meshed ice within an implicit stage, and points that give heat to it.

The surface's temperatures are an offset and a known, symmetric response to the heat that its nodes
are given: a diagonal one in the modes. What points give falls with the temperature below them,
steeply where they melt, so what remains is the gradient of a convex function.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dsbmv
from scipy.linalg.lapack import dpbtrf, dpbtrs

from iceslide_fem.arrays import Array, Index
from iceslide_fem.errors import NotConverged
from iceslide_fem.film.law import FilmStage
from iceslide_fem.interface.conjugate_gradients import conjugate_gradients
from iceslide_fem.interface.ice_modes import SurfaceModes
from iceslide_fem.interface.line_search import search
from iceslide_fem.interface.surface_grid import Placement, SurfaceGrid

MAX_ITERATIONS = 60
# Conjugate gradients for a change of the temperatures.
LINEAR_TOLERANCE, LINEAR_ITERATIONS = 1e-3, 500
UNSETTLED = "the melting part of the ice's surface does not settle"


class Fluxes(NamedTuple):
    """Heat (W) that points give to ice whose temperature is near that at which they were asked.

    Each gives the smaller of two lines, a level less its fall (W/K) times the temperature (K); all
    (n,). A film of one viscosity below rubber that takes no heat keeps to them: it gives all its
    power, or what holds the ice at T_m through the link.
    """

    level: Array
    fall: Array
    other_level: Array
    other_fall: Array

    @classmethod
    def of(cls, film: FilmStage, asked: Array, area: Array, link: float, T_m: float) -> Fluxes:
        """From the film's answer above a `link` (K m2/W) on ice of the temperatures `asked`."""
        conductance = area / link
        fall = conductance * film.ice_slope
        most = np.where(film.melting, film.dry_temperature - asked, T_m)
        level = area * film.ice_flux + fall * asked
        return cls(level, fall, conductance * most, conductance * ~film.melting)

    def take(self, index: Index) -> Fluxes:
        """Those of the points at `index`."""
        return Fluxes(*(line[index] for line in self))

    def heat(self, temperature: Array) -> Array:
        """The heat (W) at the temperatures (K)."""
        return np.minimum(
            self.level - self.fall * temperature, self.other_level - self.other_fall * temperature
        )

    def falls(self, temperature: Array) -> Array:
        """How the heat falls with the temperatures (K) there, W/K."""
        one = self.level - self.fall * temperature
        other = self.other_level - self.other_fall * temperature
        return np.where(other < one, self.other_fall, self.fall)


class Balance(NamedTuple):
    """Temperatures (K) of the nodes and the points, what the points give to the nodes (W), and
    what the ice takes more than that (W). All but the points' are of the grid's shape.
    """

    temperature: Array
    below: Array
    given: Array
    imbalance: Array


class StageSurface(NamedTuple):
    """The surface of `grid` with its `modes` in a stage, and points that lie `at` it.

    offset: temperatures of the nodes without heat, K; resistance: of the lateral modes, K m2/W;
    both of the grid's shape. `residual`, `warmed` and `taken` are not collective.
    """

    grid: SurfaceGrid
    modes: SurfaceModes
    at: Placement
    offset: Array
    resistance: Array

    def residual(self, balance: Balance) -> Array:
        """Temperature less that of ice that takes what is given, K."""
        return self.warmed(balance.imbalance)

    def balance(self, temperature: Array, below: Array, heat: Array) -> Balance:
        """What is given and taken where points of the temperature `below` give `heat` (W)."""
        given = self.grid.scatter(heat, self.at).reshape(self.grid.shape)
        return Balance(temperature, below, given, self.taken(temperature - self.offset) - given)

    def warmed(self, heat: Array) -> Array:
        """How far (K) the surface is above the offset where the ice takes the `heat` (W)."""
        return self.modes.values(self.resistance * self.modes.load_amplitudes(heat))

    def taken(self, rise: Array) -> Array:
        """What the ice takes (W) where its surface is by `rise` (K) above the offset."""
        return self.modes.loads(self.modes.amplitudes(rise) / self.resistance)

    def balanced(self, balance: Balance, fluxes: Fluxes, within: float) -> tuple[Balance, bool]:
        """The balance `within` so much (K) with these `fluxes`, from the one where they were asked;
        whether any of them depended on the temperature.

        Newton's method with a line search. Raises NotConverged.
        """
        slopes, depends = fluxes.fall, False
        for _ in range(MAX_ITERATIONS):
            residual = self.residual(balance)
            off = np.abs(residual).max()
            if off <= within:
                return balance, depends
            if not np.isfinite(off):
                break
            bands = self.grid.coupling(slopes, self.at)
            change = -residual
            if bands.any():
                depends, change = True, -self._correction(balance.imbalance, bands)
            balance = self._moved(balance, change, fluxes)
            slopes = fluxes.falls(balance.below)
        raise NotConverged(UNSETTLED)

    def _moved(self, balance: Balance, change: Array, fluxes: Fluxes) -> Balance:
        """The balance after as much of a `change` (K) of the nodes as balances best."""
        moved = self.grid.interpolate(change.ravel(), self.at)
        more, taken = self.taken(change), balance.imbalance + balance.given
        first, rise = float(np.vdot(change, taken)), float(np.vdot(change, more))
        below, given = balance.below, balance.given

        def slope_at(share: float) -> float:
            nonlocal below, given
            below = balance.below + share * moved
            given = self.grid.scatter(fluxes.heat(below), self.at).reshape(self.grid.shape)
            return first + share * rise - float(np.vdot(change, given))

        share = search(slope_at, float(np.vdot(change, balance.imbalance)))
        temperature = balance.temperature + share * change
        return Balance(temperature, below, given, taken + share * more - given)

    def _correction(self, imbalance: Array, conductance: Array) -> Array:
        """Solve (conduction + conductance) x = imbalance (W) for temperatures x, K.

        The surface's conduction is diagonal in the lateral modes, 1 / `resistance`; the
        `conductance` (W/K) of the points has the bands of `SurfaceGrid.coupling`. Conjugate
        gradients, preconditioned by the bands with the conduction of a mode in the middle: in short
        stages, in which heat does not get far along the surface, all modes have nearly the same.
        """
        grid, resistance, width = self.grid, self.resistance, self.grid.diagonals[-1]
        bands = np.zeros((width + 1, grid.n_nodes), order="F")
        bands[grid.diagonals] = conductance
        factor = bands.copy(order="F")
        factor[0] += grid.cell_area / np.sqrt(resistance.max() * resistance.min())
        factor, fault = dpbtrf(factor, lower=1, overwrite_ab=1)
        if fault:
            raise NotConverged("the linear solver of the ice's temperature fails")

        def answered(load: Array) -> Array:
            return np.asarray(dpbtrs(factor, load, lower=1)[0]).ravel()

        def load(x: Array) -> Array:
            points = dsbmv(width, 1.0, bands, x, lower=1)
            return np.asarray(self.taken(x.reshape(grid.shape)).ravel() + points)

        def close(_: Array, share: float) -> bool:
            return not share > LINEAR_TOLERANCE**2

        wanted = imbalance.ravel()
        x, _, found = conjugate_gradients(load, answered, wanted, close, LINEAR_ITERATIONS)
        if not found:
            raise NotConverged("the linear solver of the ice's temperature fails")
        return x.reshape(grid.shape)
