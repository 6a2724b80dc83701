"""Ice between two passes of the rubber: it conducts what it has, and water on it may freeze.

Water that freezes holds the ice below it at the melting point until all of it is ice. Each step is
longer than the one before by the same factor: heat that has been given for a time t changes over
times of the order of t.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import FilmHistory, FilmStage, Surface
from iceslide_fem.film.passes import molten, unfrozen
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import Solid

# The first step, relative to how long the rubber was there, and the factor on each, also of steps
# in which water freezes.
FIRST, LONGER, LONGER_WET = 5e-3, 1.25, 1.12


class Rest(NamedTuple):
    """A rest of a `time` (s) after ice was `heated` (s), and what becomes of the water in it."""

    time: float
    heated: float
    between: Literal["freeze", "drain", "keep"]


class RestingWater(NamedTuple):
    """Water of the height `water` (m), (n,), in an implicit stage of `dt` (s); no rubber on it.

    most: what the ice can take, W/m2, (n,); more would only be tried in vain.
    """

    log_height: Array
    water: Array
    dt: Array | float
    most: Array

    @property
    def power_at_start(self) -> Array:
        """No friction."""
        return np.zeros_like(self.water)

    def height(self, log_height: Array) -> Array:
        """h (m) of ln h."""
        return np.exp(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """What freezes: as much as holds the surface at T_m, or all there is; what would be warmer
        melts.
        """
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
    """What acts on ice without rubber: nothing (`film.integrators.Acting`).

    most: what the ice can take at each point, W/m2, (n,).
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
        """Water that rests."""
        return RestingWater(start.log_height, start.squeezed_height, dt, self.most)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """As before."""
        return before


def rested(
    heat: Array, water: Array, ice: IceHeat, rest: Rest, solid: Solid, comm: MPI.Comm
) -> tuple[Array, Array]:
    """Heat state of the ice after a `rest`, and what is left of the `water` (m, (n,)) on it.

    Steps are of implicit Euler while anything freezes: stages of other methods would take more
    water than there is. In one a half-space of the ice's `solid` takes no more than in the step
    before and e (T_m - T) / sqrt(dt). Collective. Raises NotConverged.
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
    """How a pass begins after a `rest`: films without water have the height `first` (m), the ice is
    of `solid`.
    """

    rest: Rest
    first: float
    solid: Solid
    comm: MPI.Comm

    def after(self, state: InterfaceState, law: InterfaceLaw, ice: IceHeat) -> InterfaceState:
        """Films of the `law` and heat of the ice, after a pass that has left `state`. Collective.

        Raises NotConverged.
        """
        height, squeezed = law.film_height(state), state.squeezed_height
        freezes = self.rest.between == "freeze"
        water = molten(height, squeezed, self.first) if freezes else np.zeros_like(squeezed)
        heat, left = rested(state.ice, water, ice, self.rest, self.solid, self.comm)
        if self.rest.between == "drain":
            height, squeezed = np.full_like(height, self.first), np.zeros_like(squeezed)
        elif freezes:
            height, squeezed = unfrozen(height, left, self.first)
        log_height, internal = law.films(height, ice.surface_temperature(heat))
        return InterfaceState(log_height, squeezed, heat, state.rubber, internal)
