"""Films on the rubber's points, over attached ice or over sliding ice."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from iceslide_fem.film.integrators import InterfaceState, Loads, advance
from iceslide_fem.film.loads import MOLTEN
from iceslide_fem.film.rubber_heat import INSULATED, Insulated, RubberColumns
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.interface.film_frame import (
    ContactLoads,
    Ice,
    InterfaceStep,
    Shifted,
    Travel,
    fresh,
)
from iceslide_fem.interface.resting import PassBegin
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Placement
from iceslide_fem.interface.window import RECENT, PassingIce, passed_over, reaches, whole_cells
from iceslide_fem.laws.protocol import InterfaceLaw, Sheared
from iceslide_fem.runtime.arrays import Array, Index


class Attached:
    """Films on the rubber's points, each with a piece of ice that stays below it."""

    nodes = None  # films are not on a grid

    def __init__(
        self,
        law: InterfaceLaw,
        ice: Ice,
        at: Placement,
        rubber: RubberColumns | Insulated = INSULATED,
    ) -> None:
        """`at`: placement of the points on the ice."""
        self.ice, self.rubber = ice, rubber
        self._law, self._at = law, at
        young = law.untouched(0)

        @lru_cache(maxsize=RECENT)
        def loads(contact: ContactLoads) -> Loads:
            return law.loads(contact.pressure, contact.speed, young)

        self._recent = loads

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice, under cold rubber."""
        heat_states = self.ice.initial(n_points), self.rubber.initial(n_points)
        state = fresh(self._law, film_height, n_points, *heat_states)
        return state._replace(age=self._law.untouched(n_points))

    def advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance each point under its pressure and speed. Collective.

        Heat flows into the rubber at points in contact only.
        """
        contacts = self._contacts(start, end)
        cover = ((start.pressure > 0.0) | (end.pressure > 0.0)).astype(float)
        ice, rubber = self.ice.under(contacts), self.rubber.covered(cover)
        state = self._frozen_where_met(state, contacts)
        warm = rubber.at_contact(state.rubber, ice, state.ice)
        age = self._law.aged(state.age, start.pressure, end.pressure, dt, warm)
        first = self._acting(start, contacts, state.age)
        last = self._acting(end, contacts, age)
        step = advance(state, first, last, dt, ice, integrator, rubber)
        after = step.state._replace(age=age)
        return InterfaceStep(step, contacts.area, last, ice, rubber, after)

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """The shear law of each point, from its film or the user's law. Collective."""
        return self._law.sheared(state, lambda: self.ice_temperature(state, contact))

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Height of each point's film, m; NaN under a law without films."""
        return self._law.film_height(state)

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """The values unchanged: films are on the points."""
        return values

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Surface temperature of the ice at the points' present positions. Collective."""
        ice = self.ice.under(self._contacts(contact, contact))
        return ice.surface_temperature(state.ice)

    def reaches(self, contact: ContactLoads) -> bool:
        """True: attached ice is below every point."""
        return True

    def water_moved(
        self, state: InterfaceState, start: ContactLoads, end: ContactLoads, sliding_distance: float
    ) -> tuple[InterfaceState, Array]:
        """No water moves: it stays at its film."""
        return state, np.zeros_like(state.log_height)

    def parts(self, contact: ContactLoads, part: Index, count: int) -> Array:
        """Each film is below the part to which its point belongs."""
        return (np.arange(count)[:, None] == part).astype(float)

    def water_areas(self, contact: ContactLoads) -> tuple[Array, Array]:
        """The area of the points, and zero beside the rubber."""
        return contact.area, np.zeros_like(contact.area)

    def shift_window(self, state: InterfaceState, travel: Travel) -> Shifted:
        """The state unchanged: attached ice has no window."""
        return Shifted(state, 0.0)

    def rested(
        self, state: InterfaceState, end: ContactLoads, start: ContactLoads, begins: PassBegin
    ) -> tuple[InterfaceState, None]:
        """State at the start of the next pass; no other ice enters. Collective.

        Raises NotConverged.
        """
        ice = self.ice.under(self._contacts(start, start))
        rubber = self.rubber.cooled(state.rubber, begins.rest.time)
        return begins.after(state, self._law, ice)._replace(rubber=rubber), None

    @property
    def internal_nodes(self) -> OwnNodes | None:
        """Nodes that hold the law's internal variables; here the points do."""
        return None

    def internal_at_points(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Internal variables of the points."""
        return state.internal

    def _frozen_where_met(self, state: InterfaceState, contacts: Contacts) -> InterfaceState:
        """The state in which water holds the surface at T_m only where it gives the ice heat."""
        if self._law.wet is None:
            return state
        internal = state.internal.copy()
        internal[MOLTEN] *= contacts.area > 0.0
        return state._replace(internal=internal)

    def _acting(self, contact: ContactLoads, contacts: Contacts, age: Array) -> Loads:
        """Loads at an end of a step, with the history of the contact there."""
        if len(age):
            return self._law.loads(contact.pressure, contact.speed, age)
        return self._recent(contact)

    def _contacts(self, start: ContactLoads, end: ContactLoads) -> Contacts:
        """Contacts at the points' positions in the middle of a step."""
        return Contacts(self._at, 0.5 * (start.area + end.area))


class AttachedBetween(Attached):
    """Attached films between meshed ice and meshed rubber."""

    def _contacts(self, start: ContactLoads, end: ContactLoads) -> Contacts:
        at, area, _ = super()._contacts(start, end)
        touching = (start.pressure > 0.0) | (end.pressure > 0.0)
        return Contacts(at, np.where(touching, area, 0.0))


class Rubbing(Attached):
    """Attached films on shared ice, under a viscous law without internal variables.

    The rubber takes no heat. Points out of contact in a step keep their state.
    """

    def advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance the points that touch the ice at an end of the step. Collective."""
        rubs = np.flatnonzero((start.pressure > 0.0) | (end.pressure > 0.0))
        at, area, _ = self._contacts(start, end)
        ice = self.ice.under(Contacts(at, area[rubs], rubs))
        first, last = (self._recent(one).take(rubs) for one in (start, end))
        films = state.log_height[rubs], state.squeezed_height[rubs]
        begin = InterfaceState(*films, state.ice)
        step = advance(begin, first, last, dt, ice, integrator)
        after = state._replace(
            log_height=state.log_height.copy(),
            squeezed_height=state.squeezed_height.copy(),
            ice=step.state.ice,
        )
        after.log_height[rubs] = step.state.log_height
        after.squeezed_height[rubs] = step.state.squeezed_height
        return InterfaceStep(step, area[rubs], last, ice, INSULATED, after, rubs)


class OnRubber(Attached):
    """Films on the rubber's points, sliding over fresh ice, as in the thesis's subroutine."""

    ice: PassingIce

    def __init__(
        self,
        law: InterfaceLaw,
        ice: PassingIce,
        rubber: RubberColumns | Insulated = INSULATED,
    ) -> None:
        super().__init__(law, ice, ice.grid.own_nodes(), rubber)

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether the window is below all touching points."""
        return reaches(self.ice.grid, contact)

    def shift_window(self, state: InterfaceState, travel: Travel) -> Shifted:
        """Shift the ice; the films stay with the rubber. Collective."""
        cells, rest = whole_cells(self.ice.grid, travel.offset)
        if cells == 0:
            return Shifted(state, travel.offset)
        return Shifted(self._over_fresh_ice(state, cells), rest)

    def _over_fresh_ice(self, state: InterfaceState, cells: int) -> InterfaceState:
        """The state after the window has moved by `cells`. Collective."""
        fresh = self.ice.initial(state.log_height.size)
        return state._replace(ice=self.ice.shifted(state.ice, cells, fresh))

    def _contacts(self, start: ContactLoads, end: ContactLoads) -> Contacts:
        return passed_over(self.ice.grid, start, end)
