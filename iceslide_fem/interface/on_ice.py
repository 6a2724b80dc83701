"""Films on the ice's nodes, over which the rubber's points move."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from iceslide_fem.film.integrators import InterfaceState, Loads, advance
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.interface.film_frame import ContactLoads, InterfaceStep, Shifted, fresh
from iceslide_fem.interface.recent import Recent
from iceslide_fem.interface.rubber_columns import InsulatedOverGrid, RubberOverGrid
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes
from iceslide_fem.interface.water import HALF, cells_passed, moved_by_a_cell
from iceslide_fem.interface.window import RECENT, PassingIce, place, reaches, shifted, whole_cells
from iceslide_fem.laws.aged_film import AgedFilm
from iceslide_fem.laws.carrying_film import CarryingFilm
from iceslide_fem.laws.film import FilmLaw
from iceslide_fem.laws.interface_law import Sheared
from iceslide_fem.runtime.arrays import Array, Index, Mask


class Nodal(Loads, Protocol):
    """Loads of films on nodes."""

    def completed(self, covered: Mask, other: Self) -> Self:
        """Loads at one end of a step, with what the `other` has where nodes are not `covered`."""

    def of(self, state: InterfaceState) -> FilmLoads:
        """The film's loads in `state`."""


NodeLoads = TypeVar("NodeLoads", bound=Nodal)


class FilmsOnNodes(ABC, Generic[NodeLoads]):
    """Films on the ice's nodes: they enter under the leading edge with h0 and are left behind.

    Loads are averaged over the points of the rubber with the same weights with which the points
    read 1/h from the nodes, so that the friction power on both sides is the same to rounding.
    """

    def __init__(
        self,
        law: FilmLaw | AgedFilm | CarryingFilm,
        ice: PassingIce,
        film_height: float,
        rubber: RubberOverGrid | InsulatedOverGrid | None = None,
        water_speed: float = 1.0,
    ) -> None:
        """`film_height` (m) is that of fresh ice; no `rubber` takes no heat.

        `water_speed` is that of squeezed-out water, a fraction of the sliding speed (see `water`).
        """
        self.ice, self.rubber = ice, rubber or InsulatedOverGrid()
        self._law = law
        self._fresh_height, self._drag = film_height, 1.0 - water_speed
        self._on_nodes = Recent(self._found_on_nodes, ice.grid.comm, RECENT)

    @property
    def nodes(self) -> OwnNodes:
        """This rank's nodes of the window."""
        return self.ice.grid.nodes

    internal_nodes = nodes

    def internal_at_points(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """ln(eta / eta_0) of the nodes, read at the points. Collective."""
        rows = [self.at_points(one, contact) for one in state.internal]
        return np.array(rows).reshape(len(rows), contact.area.size)

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice; `n_points` of rubber, as cold."""
        n = self.ice.grid.own.size
        heat_states = self.ice.initial(n), self.rubber.initial(n_points)
        state = fresh(self._law, film_height, n, *heat_states)
        return state._replace(squeezed_height=self._brought(self._x)[self.ice.grid.own])

    def advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance the films of this rank's nodes. Collective."""
        grid = self.ice.grid
        covered, first = self.on_nodes(start)
        covers, last = self.on_nodes(end)
        first, last = first.completed(covered, last), last.completed(covers, first)
        # Water that is left behind gives its heat to the ice, too, where it freezes.
        meet = covered | covers | self._law.freezes
        area = np.where(meet, grid.cell_area[grid.own], 0.0)
        ice = self.ice.under(Contacts(grid.own_nodes(), area))
        rubber = self.rubber.above(start, end)
        step = advance(state, first, last, dt, ice, integrator, rubber)
        return InterfaceStep(step, area, last, ice, rubber, step.state)

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """Shear under the films around each point. Collective."""
        shearing = self.at_points(np.exp(log_shearing(state)), contact)
        return self._law.read(shearing, self.internal_at_points(state, contact), contact.speed)

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Mean of the films around each point. Collective."""
        return self._law.height_at(state, lambda values: self.at_points(values, contact))

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """Node values read at the points. Collective."""
        grid = self.ice.grid
        return grid.interpolate(grid.allgather(values), place(grid, contact))

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the nodes, read at the points. Collective."""
        grid = self.ice.grid
        own = self.ice.under(Contacts(grid.own_nodes(), grid.cell_area[grid.own]))
        return self.at_points(own.surface_temperature(state.ice), contact)

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether the window is below all points that touch."""
        return reaches(self.ice.grid, contact)

    def water_moved(
        self, state: InterfaceState, start: ContactLoads, end: ContactLoads, sliding_distance: float
    ) -> tuple[InterfaceState, Array]:
        """Water below the rubber goes with it, cell by cell, at its fraction of the speed.
        Collective.

        Leading edges wipe a part of it off, and push out what full voids do not take in.
        """
        if self._drag == 0.0:
            return state, np.zeros_like(state.log_height)
        grid = self.ice.grid
        cell = float(grid.lines[0][1] - grid.lines[0][0])
        height, cover = grid.allgather(state.squeezed_height), self._cover(end)
        touched = (cover > 0.0) & (self._cover(start) == 0.0)
        lost = np.where(touched, self._drag * height, 0.0)
        height = (height - lost).reshape(grid.shape)
        here, there = (
            self._drag * sliding_distance,
            self._drag * (sliding_distance + end.offset - start.offset),
        )
        for _ in range(cells_passed(here, there, cell)):
            _, loads = self.on_nodes(end)
            free = grid.allgather(loads.of(state).free_height).reshape(grid.shape)
            height, pushed = moved_by_a_cell(height, (cover > HALF).reshape(grid.shape), free)
            lost += pushed.ravel()
        height = height.ravel()[grid.own]
        return state._replace(squeezed_height=height), (grid.cell_area * lost)[grid.own]

    def parts(self, contact: ContactLoads, part: Index, count: int) -> Array:
        """Fractions of what covers each of this rank's nodes. Collective."""
        amounts = contact.touching * (np.arange(count)[:, None] == part)
        given = self.ice.grid.scatter(amounts, place(self.ice.grid, contact))[:, self.ice.grid.own]
        whole = given.sum(axis=0)
        return np.divide(given, whole, out=np.zeros_like(given), where=whole > 0.0)

    def water_areas(self, contact: ContactLoads) -> tuple[Array, Array]:
        """Cells of this rank's nodes that are covered, and those that are not. Collective."""
        grid = self.ice.grid
        cell, covered = grid.cell_area[grid.own], self._cover(contact)[grid.own] > HALF
        return np.where(covered, cell, 0.0), np.where(covered, 0.0, cell)

    def on_nodes(self, contact: ContactLoads) -> tuple[Mask, NodeLoads]:
        """Which of this rank's nodes are covered, and their loads per area of the node's cell.

        A cell that is covered in part has that part of the loads, so that a film is as old as it
        should be when the leading edge has passed its cell. Collective.
        """
        return self._on_nodes.of(contact)

    @abstractmethod
    def _found_on_nodes(self, contact: ContactLoads) -> tuple[Mask, NodeLoads]:
        """What `on_nodes` says. Collective."""

    def _of_nodes(self, loads: FilmLoads, contact: ContactLoads) -> tuple[Mask, FilmLoads]:
        """The nodes' of those of the points. Collective."""
        grid, touching = self.ice.grid, contact.touching
        viscous = touching * loads.viscous
        squeeze, free = touching * loads.squeeze_rate, touching * loads.free_height
        amounts = np.stack([touching, viscous, viscous * loads.speed, squeeze, free])
        given = grid.scatter(amounts, place(grid, contact))
        area, viscous, power, squeeze, free = given[:, grid.own]
        covered, cell = area > 0.0, grid.cell_area[grid.own]
        speed = np.divide(power, viscous, out=np.zeros_like(power), where=viscous > 0.0)
        free = np.divide(free, area, out=np.ones_like(free), where=covered)
        models = loads.variable_viscosity, loads.limit
        of_nodes = FilmLoads(viscous / cell, speed, squeeze / cell, free, *models)
        return covered, of_nodes

    def _cover(self, contact: ContactLoads) -> Array:
        """Fraction of the cells of all nodes that is in contact. Collective."""
        grid = self.ice.grid
        return np.asarray(grid.scatter(contact.touching, place(grid, contact)) / grid.cell_area)

    def shift_window(self, state: InterfaceState, offset: float, distance: float) -> Shifted:
        """Shift ice and films together; water goes with what leaves. Collective."""
        grid = self.ice.grid
        cells, rest = whole_cells(grid, offset)
        if cells == 0:
            return Shifted(state, offset)
        fresh_height, _, _ = self._law.initial(self._fresh_height, 1)
        before, column = grid.allgather(state.squeezed_height), grid.n_nodes // grid.shape[0]
        water = self._brought(self._x + distance - rest)
        water[: -cells * column] = before[cells * column :]
        # The window ends in the middle of its last nodes' cells, of which the rest comes, too.
        entered, last = slice(-cells * column, None), slice(-column, None)
        rest_of_cells = grid.cell_area[-2 * column : -column] - grid.cell_area[last]
        brought = float(grid.cell_area[entered] @ water[entered] + rest_of_cells @ before[last])
        left = float(grid.cell_area @ (before - water)) + brought
        after = InterfaceState(
            shifted(grid, state.log_height, cells, float(fresh_height[0])),
            water[grid.own],
            self.ice.shifted(state.ice, cells),
            state.rubber,
            shifted(grid, state.internal, cells, list(self._law.internal_at_start)),
        )
        return Shifted(after, rest, left, brought)

    @property
    def _x(self) -> Array:
        """Places (m) of all nodes in the window."""
        grid = self.ice.grid
        return np.repeat(grid.lines[0], grid.n_nodes // grid.shape[0])

    def _brought(self, x: Array) -> Array:
        """Water (m) that lies on fresh ice at places `x` (m) of it."""
        return np.zeros_like(x)


class OnIce(FilmsOnNodes[FilmLoads]):
    """Films on the ice's nodes, of a law without a memory of the contact's own."""

    _law: FilmLaw

    def _found_on_nodes(self, contact: ContactLoads) -> tuple[Mask, FilmLoads]:
        return self._of_nodes(self._law.loads(contact.pressure, contact.speed), contact)
