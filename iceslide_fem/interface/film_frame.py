"""The film frame: where films live, their loads, and the interface that the coupled step uses.

There are three kinematics (docs/explanation/passing.md), in `on_rubber` and `on_ice`:

| ice.motion | film.carrier | films live on        | ice                                         |
|------------|--------------|----------------------|---------------------------------------------|
| attached   | (same point) | points of the rubber | stays under its point                       |
| sliding    | ice          | nodes of the ice     | passes under the block, fresh ice enters    |
| sliding    | rubber       | points of the rubber | passes under the block, fresh ice enters    |

Film frames and heat models hold no state. All that changes is in the states that they take and
return.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Loads, Step
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.interface.resting import PassBegin
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Profile
from iceslide_fem.laws.protocol import InterfaceLaw, Sheared
from iceslide_fem.runtime.arrays import Array, Index, Mask


@dataclass(frozen=True, eq=False)
class ContactLoads:
    """The rubber's contact points at one end of a step; arrays (n,) but positions (n, d-1).

    positions: horizontal, relative to the plate, m; offset: of the block on the ice's grid, m.
    Loads compare by identity, so data that follow from them can be cached.
    """

    positions: Array
    pressure: Array
    area: Array
    speed: Array
    offset: float

    @cached_property
    def touching(self) -> Array:
        """Area of the points in contact, 0 for the others, (n,), m2 (m in a slice)."""
        return np.where(self.pressure > 0.0, self.area, 0.0)


class Travel(NamedTuple):
    """Of a block over the ice.

    offset: on the grid of the window, m; distance: since t = 0, m; ahead: a window of the ice that
    enters, None for that of the scene.
    """

    offset: float
    distance: float
    ahead: InterfaceState | None = None


class Shifted(NamedTuple):
    """The interface after a shift of the window, and its water flows on all ranks.

    state: film and ice; offset: that remains, m; left, brought: water that leaves and enters the
    window with the ice, m3 (m2 in a slice).
    """

    state: InterfaceState
    offset: float
    left: float = 0.0
    brought: float = 0.0


class InterfaceStep(NamedTuple):
    """Film and heat over a step: the step, the area of each film (m2), loads at its end.

    ice, rubber: thermal responses of the bodies; at: numbers of the films that the step changes;
    state: of all films at its end.
    """

    step: Step
    area: Array
    loads: Loads
    ice: IceHeat
    rubber: RubberHeat
    state: InterfaceState
    at: Index | slice = slice(None)

    def local_error(self, scale: Array) -> Array:
        """Relative local errors (n,) over the step; `scale`: reference temperature, K."""
        return self.loads.local_error(self.step, self.ice, self.rubber, scale)

    def friction(self) -> Array:
        """Magnitude of the friction force of each film at the end of the step, N."""
        return self.area * self.loads.force(self.step)

    def change(self, before: InterfaceStep) -> Array:
        """Relative change (n,) of the shear from another trial, `before`, of the same step."""
        return self.loads.shear_change(self.state, before.state, self.ice)[self.at]

    def of_all(self, values: Array | Mask) -> Array:
        """Values of all films from `values` of the step's films; 0 for the others."""
        every = np.zeros(self.state.log_height.size)
        every[self.at] = values
        return every


class Rises(NamedTuple):
    """Temperature rises (K) at all local dofs of the quadratic spaces, ghosts included.

    They are above the initial temperature, in ice mesh and rubber mesh; None without a mesh that
    conducts heat.
    """

    ice: Array | None = None
    rubber: Array | None = None


class Unmeshed:
    """Members of `Ice` for ice without a finite element mesh."""

    equation, places = None, None

    @property
    def n_dofs(self) -> int:
        """0: there is no mesh."""
        return 0

    def rises(self, heat_state: Array) -> Rises:
        """None."""
        return Rises()


class Ice(Protocol):
    """The ice of a run. `initial` and the heat state are those of `IceHeat`.

    nodes: of the surface, None if the rubber's points hold the heat state; n_dofs: temperature
    unknowns of a mesh on all ranks, 0 without one.
    """

    @property
    def nodes(self) -> OwnNodes | None:
        """This rank's nodes of the surface."""

    @property
    def n_dofs(self) -> int:
        """Number of temperature unknowns of its mesh."""

    @property
    def equation(self) -> HeatEquation | None:
        """Heat equation of meshed ice, whose unknowns are the heat state; else None."""

    @property
    def places(self) -> Array | None:
        """Positions of the unknowns of a finite element mesh, (n_own, d), m; None without one."""

    def rises(self, heat_state: Array) -> Rises:
        """Rises at the nodes of finite element meshes. Collective."""

    def initial(self, n_points: int) -> Array:
        """Heat state of ice at its initial temperature."""

    def under(self, contacts: Contacts) -> IceHeat:
        """The thermal response of the ice below `contacts`."""

    def profile(self, heat_state: Array) -> Profile | None:
        """Temperature and heat below the surface; None for a closed form. Collective."""

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays of a heat state, (..., n) at the nodes. Collective."""

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays, also those of shallower ice. Collective."""


class Kept(Protocol):
    """Rubber whose heat state checkpoints save, (..., n) at the points, as of `Column`."""

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays of a heat state."""

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays, also those of a shorter run."""


class FilmFrame(Protocol):
    """The interface between block and ice, as the coupled step uses it."""

    @property
    def ice(self) -> Ice:
        """The ice's heat model."""

    @property
    def rubber(self) -> Kept:
        """The rubber's heat model."""

    @property
    def nodes(self) -> OwnNodes | None:
        """Nodes that hold the films; None if the rubber's points do."""

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice below `n_points` of the rubber."""

    def advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance films and ice by `dt` (s) while the rubber goes from `start` to `end`."""

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """The shear law at the rubber's points for an interface in `state`. Collective."""

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Film height at the rubber's points, (n,), m."""

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """Values at the films, interpolated to the rubber's points, (n,)."""

    @property
    def internal_nodes(self) -> OwnNodes | None:
        """Nodes that hold the law's internal variables; None if the rubber's points do."""

    def internal_at_points(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """The law's internal variables at the rubber's points, (m, n). Collective."""

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the ice's surface at the rubber's points, (n,), K."""

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether there is ice below all touching points of this rank."""

    def water_moved(
        self, state: InterfaceState, start: ContactLoads, end: ContactLoads, sliding_distance: float
    ) -> tuple[InterfaceState, Array]:
        """State after squeezed-out water has moved from `start` to `end`, and the wiped water.

        Wiped water is that of each film, (n,), m3 (m2 in a slice). sliding_distance: of the block
        over the ice at `start`, m.
        """

    def parts(self, contact: ContactLoads, part: Index, count: int) -> Array:
        """Fraction of each film that is below each part of the rubber, (count, n). Collective.

        part: number of the part to which each contact point belongs.
        """

    def water_areas(self, contact: ContactLoads) -> tuple[Array, Array]:
        """Area of each film's squeezed-out water below the rubber, and beside it, m2."""

    def shift_window(self, state: InterfaceState, travel: Travel) -> Shifted:
        """State and offset after the window has caught up with the block by whole cells."""

    def rested(
        self, state: InterfaceState, end: ContactLoads, start: ContactLoads, begins: PassBegin
    ) -> tuple[InterfaceState, InterfaceState | None]:
        """State at the start of the next pass, and a window of the ice `ahead` of it. Collective.

        state, end: at the end of the last pass; start: of the next one. Raises NotConverged.
        """


def fresh(
    law: InterfaceLaw, film_height: float, n: int, ice: Array, rubber: Array
) -> InterfaceState:
    """`n` films of `film_height` (m) without squeezed-out water, with given heat states."""
    log_height, squeezed, internal = law.initial(film_height, n)
    return InterfaceState(log_height, squeezed, ice, rubber, internal)
