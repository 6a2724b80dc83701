"""What carries the film: the loads on it, and what the coupled step needs to know of it.

There are three kinematics (docs/explanation/passing.md), in `on_rubber` and `on_ice`:

| ice.motion | film.carrier | films live on        | ice                                         |
|------------|--------------|----------------------|---------------------------------------------|
| attached   | (same point) | points of the rubber | stays under its point                       |
| sliding    | ice          | nodes of the ice     | passes under the block, fresh ice enters    |
| sliding    | rubber       | points of the rubber | passes under the block, fresh ice enters    |

Carriers and models of heat are the same before and after a step: all that changes is in the
states that they are given and give.
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
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Profile
from iceslide_fem.laws.interface_law import InterfaceLaw, Sheared
from iceslide_fem.runtime.arrays import Array, Index, Mask


@dataclass(frozen=True, eq=False)
class ContactLoads:
    """The rubber's contact points at one end of a step; arrays (n,) but positions (n, d-1).

    positions: horizontal, relative to the plate, m; offset: of the block on the ice's grid, m. Each
    is one of its own, so that what follows from it need not be found twice.
    """

    positions: Array
    pressure: Array
    area: Array
    speed: Array
    offset: float

    @cached_property
    def touching(self) -> Array:
        """Area where there is contact and 0 elsewhere, (n,), m2 (m in a slice)."""
        return np.where(self.pressure > 0.0, self.area, 0.0)


class Shifted(NamedTuple):
    """The interface after a shift of the window, the offset (m) that remains, and the water that
    has left the window with the ice and that has come with ice, m3 (m2 in a slice), of all ranks.
    """

    state: InterfaceState
    offset: float
    left: float = 0.0
    brought: float = 0.0


class InterfaceStep(NamedTuple):
    """Film and heat over a step: the step, what each film stands for (m2), loads at its end.

    ice, rubber: the bodies as the films met them; state: of all films at the
    end of the step, which is that of those `at` these numbers: it changes no others.
    """

    step: Step
    area: Array
    loads: Loads
    ice: IceHeat
    rubber: RubberHeat
    state: InterfaceState
    at: Index | slice = slice(None)

    def local_error(self, scale: Array) -> Array:
        """Relative local errors (n,) over the step; `scale` of temperatures, K."""
        return self.loads.local_error(self.step, self.ice, self.rubber, scale)

    def friction(self) -> Array:
        """Size of the friction force (N) under each film at the end of the step."""
        return self.area * self.loads.force(self.step)

    def change(self, before: InterfaceStep) -> Array:
        """Relative change (n,) of the shear from that of another trial of the step."""
        return self.loads.shear_change(self.state, before.state, self.ice)[self.at]

    def of_all(self, values: Array | Mask) -> Array:
        """Values (n,) of the step's films among those of all films, of which the others have 0."""
        every = np.zeros(self.state.log_height.size)
        every[self.at] = values
        return every


class Rises(NamedTuple):
    """Rises (K) above the initial temperature at all local dofs of quadratic spaces, ghosts
    included: of the ice's mesh and of the rubber's, None where there is none that takes heat.
    """

    ice: Array | None = None
    rubber: Array | None = None


class Unmeshed:
    """What ice without a finite element mesh says of one."""

    equation, places = None, None

    @property
    def n_dofs(self) -> int:
        """No unknowns of a mesh."""
        return 0

    def rises(self, heat_state: Array) -> Rises:
        """None."""
        return Rises()


class Ice(Protocol):
    """The ice of a run. `initial` and the heat state are those of `IceHeat`.

    nodes: of the surface, None where it has the rubber's points; n_dofs: temperature unknowns of a
    mesh on all ranks, 0 without one.
    """

    @property
    def nodes(self) -> OwnNodes | None:
        """This rank's nodes of the surface."""

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns of its mesh."""

    @property
    def equation(self) -> HeatEquation | None:
        """That of ice on a finite element mesh, whose unknowns are its heat state; else None."""

    @property
    def places(self) -> Array | None:
        """Where the unknowns of a finite element mesh are, (n_own, d), m; None without one."""

    def rises(self, heat_state: Array) -> Rises:
        """Rises at the nodes of finite element meshes. Collective."""

    def initial(self, n_points: int) -> Array:
        """Heat state of ice at its initial temperature."""

    def under(self, contacts: Contacts) -> IceHeat:
        """The ice as it answers below `contacts`."""

    def profile(self, heat_state: Array) -> Profile | None:
        """Temperature and heat below the surface; None of a closed form. Collective."""

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """What checkpoints keep of a heat state, (..., n) at the nodes. Collective."""

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state of what was `saved`, also by ice that ended higher. Collective."""


class Kept(Protocol):
    """Rubber whose heat state is kept in checkpoints, (..., n) at the points: that of `Column`."""

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """What checkpoints keep of a heat state."""

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state of what was `saved`, also by rubber for shorter runs."""


class FilmFrame(Protocol):
    """What the coupled step needs to know of the interface."""

    @property
    def ice(self) -> Ice:
        """The ice's heat model."""

    @property
    def rubber(self) -> Kept:
        """The rubber's."""

    @property
    def nodes(self) -> OwnNodes | None:
        """Nodes that carry the films; None if the rubber's points do."""

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
        """Shear at the rubber's points on an interface in `state`. Collective."""

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Film height that shears the rubber at its points, (n,), m."""

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """Values that live where the films do, at the rubber's points, (n,)."""

    @property
    def internal_nodes(self) -> OwnNodes | None:
        """Nodes that hold the law's internal variables; None if the rubber's points do."""

    def internal_at_points(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """The law's internal variables at the rubber's points, (m, n). Collective."""

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the ice's surface at the rubber's points, (n,), K."""

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether there is ice below all points that touch, on this rank."""

    def water_moved(
        self, state: InterfaceState, start: ContactLoads, end: ContactLoads, sliding_distance: float
    ) -> tuple[InterfaceState, Array]:
        """State after squeezed-out water has gone its way from `start` to `end`, and what of it was
        wiped off at every film, (n,), m3 (m2 in a slice).

        `sliding_distance`: the block's over the ice before, m.
        """

    def parts(self, contact: ContactLoads, part: Index, count: int) -> Array:
        """What fraction of each film is below each part of the rubber, (count, n): its points have
        the numbers `part`. Collective.
        """

    def water_areas(self, contact: ContactLoads) -> tuple[Array, Array]:
        """What each film's squeezed-out height covers below the rubber, and beside it, m2."""

    def shift_window(self, state: InterfaceState, offset: float, distance: float) -> Shifted:
        """State and offset after the window has caught up with the block by whole cells.

        `distance`: of the block over the ice since t = 0, m.
        """


def fresh(
    law: InterfaceLaw, film_height: float, n: int, ice: Array, rubber: Array
) -> InterfaceState:
    """`n` films of `film_height` (m), nothing squeezed out, on the contents of ice and rubber."""
    log_height, squeezed, internal = law.initial(film_height, n)
    return InterfaceState(log_height, squeezed, ice, rubber, internal)
