"""Ice between two passes of the rubber: heat conduction, and freezing of water on it.

Water that freezes holds the ice below it at the melting point until all of it is ice. Step lengths
grow by a constant factor, because heat given over a time t diffuses over times of the order of t.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import FilmHistory, FilmStage, Surface
from iceslide_fem.film.passes import Between, after_rest, molten
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import Solid

# First step over the contact time; growth factor of steps, and of steps in which water freezes.
FIRST, LONGER, LONGER_WET = 5e-3, 1.25, 1.12


class Rest(NamedTuple):
    """A rest of a `time` (s) after `heated` (s) of contact; between: what happens to water."""

    time: float
    heated: float
    between: Between

    def after(self, passed: float) -> Rest:
        """The rest of ice that the rubber met `passed` (s) before it rests, and meets again."""
        return self._replace(time=self.time + self.heated - passed, heated=passed)

    def shorter(self, time: float) -> Rest:
        """A rest that ends a `time` (s) earlier."""
        return self._replace(time=max(self.time - time, 0.0))


class RestingWater(NamedTuple):
    """Water of the height `water` (m), (n,), without rubber, in an implicit stage of `dt` (s).

    most: upper bound of the heat flux into the ice, W/m2, (n,).
    """

    log_height: Array
    water: Array
    dt: Array | float
    most: Array

    def height(self, log_height: Array) -> Array:
        """h (m) of ln h."""
        return np.exp(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """Freezing rate that holds the surface at T_m, limited by the water; warmer ice melts."""
        nothing = np.zeros_like(self.water)
        available = ice.solid.melting_enthalpy * np.maximum(self.water, 0.0) / self.dt
        available = np.minimum(available, self.most)
        given = np.minimum(ice.melted_flux, available)
        holds = available > given
        left = self.water - self.dt * given / ice.solid.melting_enthalpy
        return FilmStage(
            self.log_height,
            left,
            nothing,
            given,
            -given,
            ice.offset + ice.resistance * available,
            holds,
            np.zeros_like(holds),
            nothing,
            holds.astype(float),
            nothing,
        )


class Resting(NamedTuple):
    """Loads of ice without rubber: none (`film.integrators.Acting`).

    most: upper bound of the heat flux into the ice, W/m2, (n,).
    """

    most: Array

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> Resting:
        """The same."""
        return self

    def at(self, end: Resting, fraction: float) -> Resting:
        """The same."""
        return self

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None,
        close: float,
    ) -> RestingWater:
        """The water in this stage."""
        return RestingWater(start.log_height, start.squeezed_height, dt, self.most)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """The internal variables unchanged."""
        return before


def rested(
    heat: Array, water: Array, ice: IceHeat, rest: Rest, solid: Solid, comm: MPI.Comm
) -> tuple[Array, Array]:
    """Heat state of the ice after a `rest`, and the rest of the `water` (m, (n,)).

    Steps with freezing use implicit Euler, because stages of other methods may freeze more water
    than there is. The heat flux into the ice is bounded by the last flux plus e (T_m - T) /
    sqrt(dt), that of a half-space of the `solid` with effusivity e. Collective. Raises
    NotConverged.
    """
    taken = np.zeros_like(water)
    state = InterfaceState(np.zeros_like(water), water, heat)
    done, dt = 0.0, FIRST * rest.heated
    while done < rest.time:
        left = rest.time - done
        dt = left if left < 1.1 * dt else dt
        wet = comm.allreduce(float(state.squeezed_height.max(initial=0.0)), op=MPI.MAX) > 0.0
        name, longer = ("implicit-euler", LONGER_WET) if wet else ("sdirk2", LONGER)
        coldness = solid.melting_temperature - ice.surface_temperature(state.ice)
        loads = Resting(taken + solid.effusivity * np.maximum(coldness, 0.0) / np.sqrt(dt))
        step = advance(state, loads, loads, dt, ice, INTEGRATORS[name])
        state, taken = step.state, np.maximum(step.last.ice_flux, 0.0)
        done, dt = done + dt, longer * dt
    return state.ice, np.maximum(state.squeezed_height, 0.0)


class PassBegin(NamedTuple):
    """The start of a pass after a `rest`.

    first: height of films without water, m; solid: of the ice.
    """

    rest: Rest
    first: float
    solid: Solid
    comm: MPI.Comm

    def after(self, state: InterfaceState, law: InterfaceLaw, ice: IceHeat) -> InterfaceState:
        """Films and heat of the ice at the start of a pass. Collective.

        state: at the end of the last pass.

        Raises NotConverged.
        """
        first, between = self.first, self.rest.between
        water = molten(state, law, first, between)
        heat, left = rested(state.ice, water, ice, self.rest, self.solid, self.comm)
        after = after_rest(state, law, first, between, left, ice.surface_temperature(heat))
        return after._replace(ice=heat)
