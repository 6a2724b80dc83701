"""Who carries the film, and how rubber and ice find each other: three kinematics (docs/theory.md).

| ice.motion | film.carrier | films live on        | ice                                         |
|------------|--------------|----------------------|---------------------------------------------|
| attached   | (same point) | points of the rubber | stays under its point                       |
| sliding    | ice          | nodes of the ice     | passes under the block, fresh ice enters    |
| sliding    | rubber       | points of the rubber | passes under the block, fresh ice enters    |

The ice that passes lies on a window that follows the block: between two shifts the block moves
over the window's grid by the `offset`; when that reaches a cell, all content moves by one cell,
exactly. A carrier's methods are functions of the states given; only its ice keeps where the
points lie within the step that is being tried.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.film.friction import FilmFriction
from iceslide_fem.film.ice_heat import Column, HalfSpace
from iceslide_fem.film.integrators import Integrator, InterfaceState, Step, advance
from iceslide_fem.film.law import FilmLoads
from iceslide_fem.film.rubber_heat import INSULATED, Insulated, RubberColumns
from iceslide_fem.interface.ice_columns import GridColumns, GridColumnsUnderPoints
from iceslide_fem.interface.ice_continuum import Continuum
from iceslide_fem.interface.rubber_columns import RubberOverGrid
from iceslide_fem.interface.surface_grid import Placement


class ContactLoads(NamedTuple):
    """The rubber's contact points at one end of a step; arrays (n,) but positions (n, d-1).

    positions: horizontal, relative to the plate, m; offset: of the block on the ice's grid, m.
    """

    positions: Array
    pressure: Array
    area: Array
    speed: Array
    offset: float


class InterfaceStep(NamedTuple):
    """Film and heat over a step: the step, what each film stands for (m2), loads at its end."""

    step: Step
    area: Array
    loads: FilmLoads


class Carrier(Protocol):
    """What the coupled step needs to know of the interface."""

    friction: FilmFriction

    @property
    def rubber(self) -> RubberColumns | Insulated:
        """The rubber's heat model."""

    @property
    def ice(self) -> Column | HalfSpace | Continuum:
        """The ice's heat model."""

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice below `n_points` of the rubber."""

    def pass_over(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance films and ice by `dt` (s) while the rubber goes from `start` to `end`."""

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Film height that shears the rubber at its points, (n,), m."""

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """Values that live where the films do, at the rubber's points, (n,)."""

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the ice's surface at the rubber's points, (n,), K."""

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether there is ice below all points that touch, on this rank."""

    def window_shifted(self, state: InterfaceState, offset: float) -> tuple[InterfaceState, float]:
        """State and offset after the window has caught up with the block by whole cells."""


class Attached:
    """Films on the rubber's points, each with its own piece of ice that stays below it."""

    def __init__(
        self,
        friction: FilmFriction,
        ice: Column | HalfSpace | Continuum,
        rubber: RubberColumns | Insulated = INSULATED,
    ) -> None:
        """`ice` has been placed under the points."""
        self.friction, self.ice, self.rubber = friction, ice, rubber

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice, under rubber as cold."""
        contents = self.ice.initial(n_points), self.rubber.initial(n_points)
        return _fresh(film_height, n_points, *contents)

    def pass_over(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance every point under its own pressure and speed. Collective."""
        area = 0.5 * (start.area + end.area)
        if isinstance(self.ice, Continuum):
            self.ice.area = area
        return self._advance(state, start, end, dt, integrator, area)

    def _advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
        area: Array,
    ) -> InterfaceStep:
        """Advance every point on its own; heat reaches the rubber where there is contact."""
        if isinstance(self.rubber, RubberColumns):
            self.rubber.cover = ((start.pressure > 0.0) | (end.pressure > 0.0)).astype(float)
        loads = [self.friction.loads(contact.pressure, contact.speed) for contact in (start, end)]
        step = advance(state, loads[0], loads[1], dt, self.ice, integrator, self.rubber)
        return InterfaceStep(step, area, loads[1])

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """The points' own films."""
        return np.exp(state.log_height)

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """The points' own values."""
        return values

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of each point's own ice. Collective."""
        return self.ice.surface_temperature(state.ice)

    def reaches(self, contact: ContactLoads) -> bool:
        """Attached ice is below every point."""
        return True

    def window_shifted(self, state: InterfaceState, offset: float) -> tuple[InterfaceState, float]:
        """Attached ice has no window to move."""
        return state, 0.0


class OnRubber(Attached):
    """Films on the rubber's points, which slide over fresh ice: the thesis's subroutine."""

    ice: GridColumnsUnderPoints | Continuum

    def pass_over(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance every point; the ice is where it is in the middle of the step. Collective."""
        self.ice.at, self.ice.area = _middle(self.ice, start, end)
        return self._advance(state, start, end, dt, integrator, self.ice.area)

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the ice that is below the points now. Collective."""
        self.ice.at = _place(self.ice, contact)
        return self.ice.surface_temperature(state.ice)

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether the window is below all points that touch."""
        return _reaches(self.ice, contact)

    def window_shifted(self, state: InterfaceState, offset: float) -> tuple[InterfaceState, float]:
        """Shift the ice; the films stay with the rubber. Collective."""
        cells, rest = _whole_cells(self.ice, offset)
        if cells == 0:
            return state, offset
        return state._replace(ice=self.ice.shifted(state.ice, cells)), rest


class OnIce:
    """Films on the ice's nodes: they enter under the leading edge with h0 and are left behind.

    Loads are averaged over the points of the rubber with the same weights with which the points
    read 1/h from the nodes, so that the friction power on both sides is the same to rounding.
    """

    def __init__(
        self,
        friction: FilmFriction,
        ice: GridColumns | Continuum,
        film_height: float,
        rubber: RubberOverGrid | Insulated = INSULATED,
    ) -> None:
        """`film_height` (m) is that of fresh ice."""
        self.friction, self.ice, self.rubber = friction, ice, rubber
        self._fresh_height = film_height

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice; `n_points` of rubber, as cold."""
        n = self.ice.grid.own.size
        return _fresh(film_height, n, self.ice.initial(n), self.rubber.initial(n_points))

    def pass_over(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance the films of this rank's nodes. Collective."""
        (covered, first), (covers, last) = (self._on_nodes(contact) for contact in (start, end))
        # A node that is covered at one end only has the speed and the free height of that end.
        first, last = (
            loads._replace(
                speed=np.where(here, loads.speed, other.speed),
                free_height=np.where(here, loads.free_height, other.free_height),
            )
            for here, loads, other in ((covered, first, last), (covers, last, first))
        )
        grid = self.ice.grid
        area = np.where(covered | covers, grid.cell_area[grid.own], 0.0)
        if isinstance(self.ice, Continuum):
            self.ice.area = area
        if isinstance(self.rubber, RubberOverGrid):
            self.rubber.at, self.rubber.area = _middle(self.ice, start, end)
        step = advance(state, first, last, dt, self.ice, integrator, self.rubber)
        return InterfaceStep(step, area, last)

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Harmonic mean of the films around each point. Collective."""
        inverse = self.ice.grid.allgather(np.exp(-state.log_height))
        return np.asarray(1.0 / self.ice.grid.interpolate(inverse, _place(self.ice, contact)))

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """Node values read at the points. Collective."""
        grid = self.ice.grid.allgather(np.asarray(values, dtype=float))
        return self.ice.grid.interpolate(grid, _place(self.ice, contact))

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the nodes, read at the points. Collective."""
        return self.at_points(self.ice.surface_temperature(state.ice), contact)

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether the window is below all points that touch."""
        return _reaches(self.ice, contact)

    def window_shifted(self, state: InterfaceState, offset: float) -> tuple[InterfaceState, float]:
        """Shift ice and films together. Collective."""
        grid = self.ice.grid
        cells, rest = _whole_cells(self.ice, offset)
        if cells == 0:
            return state, offset

        def moved(own: Array, fresh: float) -> Array:
            nodes = grid.allgather(own).reshape(grid.shape)
            full = np.full_like(nodes, fresh)
            full[: grid.shape[0] - cells] = nodes[cells:]
            return np.asarray(full.ravel()[grid.own])

        fresh = float(np.log(self._fresh_height))
        return (
            InterfaceState(
                moved(state.log_height, fresh),
                moved(state.squeezed_height, 0.0),
                self.ice.shifted(state.ice, cells),
                state.rubber,
            ),
            rest,
        )

    def _on_nodes(self, contact: ContactLoads) -> tuple[Mask, FilmLoads]:
        """Which of this rank's nodes are covered, and their loads per area of the node's cell.

        A cell that is covered in part has that part of the loads, so that a film is as old as it
        should be when the leading edge has passed its cell. Collective.
        """
        grid = self.ice.grid
        loads = self.friction.loads(contact.pressure, contact.speed)
        touching = np.where(contact.pressure > 0.0, contact.area, 0.0)
        viscous = touching * loads.viscous
        amounts = np.stack(
            [
                touching,
                viscous,
                viscous * loads.speed,
                touching * loads.squeeze_rate,
                touching * loads.free_height,
            ]
        )
        given = grid.scatter(amounts, _place(self.ice, contact))
        area, viscous, power, squeeze, free = given[:, grid.own]
        covered, cell = area > 0.0, grid.cell_area[grid.own]
        speed = np.divide(power, viscous, out=np.zeros_like(power), where=viscous > 0.0)
        free = np.divide(free, area, out=np.ones_like(free), where=covered)
        return covered, FilmLoads(viscous / cell, speed, squeeze / cell, free)


def _fresh(film_height: float, n: int, ice: Array, rubber: Array) -> InterfaceState:
    return InterfaceState(np.full(n, np.log(film_height)), np.zeros(n), ice, rubber)


def _middle(
    ice: GridColumns | Continuum, start: ContactLoads, end: ContactLoads
) -> tuple[Placement, Array]:
    """Where the points lie in the middle of a step, and the mean area that each touches (n,)."""
    middle = end._replace(
        positions=0.5 * (start.positions + end.positions),
        offset=0.5 * (start.offset + end.offset),
    )
    touching = [np.where(contact.pressure > 0.0, contact.area, 0.0) for contact in (start, end)]
    return _place(ice, middle), 0.5 * (touching[0] + touching[1])


def _place(ice: GridColumns | Continuum, contact: ContactLoads) -> Placement:
    """Where the rubber's points lie on the window's grid."""
    positions = contact.positions.copy()
    positions[:, 0] += contact.offset
    return ice.grid.place(positions)


def _reaches(ice: GridColumns | Continuum, contact: ContactLoads) -> bool:
    """Whether the points that touch lie between the window's ends."""
    line, x = ice.grid.lines[0], contact.positions[contact.pressure > 0.0, 0] + contact.offset
    return bool(((line[0] <= x) & (x <= line[-1])).all())


def _whole_cells(ice: GridColumns | Continuum, offset: float) -> tuple[int, float]:
    """Whole cells of the window's grid in `offset` (m), and what is left."""
    line = ice.grid.lines[0]
    cell = float(line[1] - line[0])
    cells = int(np.floor(offset / cell + 1e-9))
    return cells, offset - cells * cell
