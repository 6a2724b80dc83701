"""Films on nodes of the ice; the rubber's points move over them."""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.hysteresis import Rough
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.interface.film_frame import ContactLoads, InterfaceStep, Shifted, Travel, fresh
from iceslide_fem.interface.moving_water import HALF, by_cells, flowing
from iceslide_fem.interface.resting import PassBegin
from iceslide_fem.interface.rubber_mesh import InsulatedOverGrid, RubberOverGrid
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Recent
from iceslide_fem.interface.window import (
    RECENT,
    PassingIce,
    alike,
    covered_lines,
    place,
    reaches,
    shifted,
    whole_cells,
)
from iceslide_fem.laws.film import YOUNG, FilmLaw
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.runtime.arrays import Array, Index, Mask


class OnIce:
    """Films on the ice's nodes: they enter at the leading edge with h0 and leave at the trailing
    one.

    Points read 1/h from the nodes with interpolation weights. Nodes average the loads of the points
    with the same weights. The friction power on both sides is therefore equal to rounding. Water in
    voids that carry stays with the ice, and the age of the contact with the points of the rubber.
    """

    def __init__(
        self,
        law: FilmLaw,
        ice: PassingIce,
        film_height: float,
        rubber: RubberOverGrid | InsulatedOverGrid | None = None,
        water_speed: float = 1.0,
    ) -> None:
        """film_height: of fresh ice, m; rubber: None if it takes no heat; water_speed: speed of
        squeezed-out water over the sliding speed (see `water`).
        """
        self.ice, self.rubber = ice, rubber or InsulatedOverGrid()
        self._law = law
        self._fresh_height, self._drag = film_height, 1.0 - water_speed
        self._move = by_cells if law.wet is None else flowing
        young = law.untouched(0)

        def found(contact: ContactLoads) -> tuple[Mask, FilmLoads]:
            return self._found_on_nodes(contact, young)

        self._on_nodes = Recent(found, ice.grid.comm, RECENT)

    @property
    def nodes(self) -> OwnNodes:
        """This rank's nodes of the window."""
        return self.ice.grid.nodes

    internal_nodes = nodes

    def internal_at_points(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Internal variables of the nodes, interpolated to the points. Collective."""
        rows = [self.at_points(one, contact) for one in state.internal]
        return np.array(rows).reshape(len(rows), contact.area.size)

    def start(self, film_height: float, n_points: int) -> InterfaceState:
        """Films of the initial height (m) on cold ice under `n_points` of cold rubber."""
        state = self._untouched(film_height, 0.0)
        age = self._law.untouched(n_points)
        return state._replace(rubber=self.rubber.initial(n_points), age=age)

    def _untouched(self, film_height: float, distance: float) -> InterfaceState:
        """A window of the scene's ice after a `distance` (m), with films of the height (m)."""
        n = self.ice.grid.own.size
        water = self._law.brought(self._x + distance)[self.ice.grid.own]
        state = fresh(self._law, film_height, n, self.ice.initial(n), np.zeros((0, 0)))
        return state._replace(squeezed_height=water)

    def advance(
        self,
        state: InterfaceState,
        start: ContactLoads,
        end: ContactLoads,
        dt: float,
        integrator: Integrator,
    ) -> InterfaceStep:
        """Advance the films of this rank's nodes, and the age of the contact. Collective."""
        grid = self.ice.grid
        warm = self.rubber.at_points(state.rubber)
        age = self._law.aged(state.age, start.pressure, end.pressure, dt, warm)
        covered, first = self.on_nodes(start, state.age)
        covers, last = self.on_nodes(end, age)
        first, last = first.completed(covered, last), last.completed(covers, first)
        meet = covered | covers | self._law.freezes_open(state)
        area = np.where(meet, grid.cell_area[grid.own], 0.0)
        ice = self.ice.under(Contacts(grid.own_nodes(), area))
        rubber = self.rubber.above(start, end)
        step = advance(state, first, last, dt, ice, integrator, rubber)
        return InterfaceStep(step, area, last, ice, rubber, step.state._replace(age=age))

    def sheared(self, state: InterfaceState, contact: ContactLoads) -> Sheared:
        """The shear law of each point, from the films around it. Collective."""
        of_nodes = np.exp(log_shearing(state))
        here, internal = (
            self.at_points(of_nodes, contact), self.internal_at_points(state, contact)
        )  # fmt: skip
        touching = self._law.read(here, internal, contact.speed, state.age)
        if self._law.wet is None:
            return self._law.on_rough_ice(touching, lambda pressure: pressure)
        _, loads = self.on_nodes(contact, state.age)
        growth = self.at_points(loads.growth(state) * of_nodes, contact) / here

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            factor = growth.reshape(pressure.shape)
            tau, by_pressure, by_speed = touching(pressure, speed)
            return factor * tau, factor * by_pressure, factor * by_speed

        if self._law.rough is None:
            return shear
        share = self.at_points(np.broadcast_to(loads.share(state), of_nodes.shape), contact)
        return self._law.on_rough_ice(shear, lambda p: share.reshape(p.shape) * p)

    def film_height(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Mean of the films around each point. Collective."""
        return self._law.height_at(state, lambda values: self.at_points(values, contact))

    def at_points(self, values: Array, contact: ContactLoads) -> Array:
        """Nodal values interpolated to the points. Collective."""
        grid = self.ice.grid
        return grid.interpolate(grid.allgather(values), place(grid, contact))

    def ice_temperature(self, state: InterfaceState, contact: ContactLoads) -> Array:
        """Temperature of the nodes, interpolated to the points. Collective."""
        grid = self.ice.grid
        own = self.ice.under(Contacts(grid.own_nodes(), grid.cell_area[grid.own]))
        return self.at_points(own.surface_temperature(state.ice), contact)

    def reaches(self, contact: ContactLoads) -> bool:
        """Whether the window is below all points that touch."""
        return reaches(self.ice.grid, contact)

    def water_moved(
        self, state: InterfaceState, start: ContactLoads, end: ContactLoads, sliding_distance: float
    ) -> tuple[InterfaceState, Array]:
        """Move water below the rubber at its fraction of the speed (`moving_water`). Collective."""
        if self._drag == 0.0:
            return state, np.zeros_like(state.log_height)
        grid = self.ice.grid
        cell = float(grid.lines[0][1] - grid.lines[0][0])
        height, cover = grid.allgather(state.squeezed_height), self._cover(end)
        before, after = (part.reshape(grid.shape) for part in (self._cover(start), cover))
        _, loads = self.on_nodes(end, state.age)
        free = grid.allgather(loads.free_height).reshape(grid.shape)
        way = sliding_distance / cell, (sliding_distance + end.offset - start.offset) / cell
        height, lost = self._move(height.reshape(grid.shape), before, after, free, self._drag, *way)
        lost = lost.ravel()
        height = height.ravel()[grid.own]
        return state._replace(squeezed_height=height), (grid.cell_area * lost)[grid.own]

    def parts(self, contact: ContactLoads, part: Index, count: int) -> Array:
        """Fraction of the cover of each of this rank's nodes by each part. Collective."""
        amounts = contact.touching * (np.arange(count)[:, None] == part)
        given = self.ice.grid.scatter(amounts, place(self.ice.grid, contact))[:, self.ice.grid.own]
        whole = given.sum(axis=0)
        return np.divide(given, whole, out=np.zeros_like(given), where=whole > 0.0)

    def water_areas(self, contact: ContactLoads) -> tuple[Array, Array]:
        """Covered and uncovered cell areas of this rank's nodes, m2. Collective."""
        grid = self.ice.grid
        cell, covered = grid.cell_area[grid.own], self._cover(contact)[grid.own] > HALF
        return np.where(covered, cell, 0.0), np.where(covered, 0.0, cell)

    def on_nodes(self, contact: ContactLoads, age: Array = YOUNG) -> tuple[Mask, FilmLoads]:
        """Mask of this rank's covered nodes, and their loads per cell area. Collective.

        A partly covered cell has the same fraction of the loads. A film then has the right age when
        the leading edge has passed its cell. age: history of the contact at the points.
        """
        return self._found_on_nodes(contact, age) if len(age) else self._on_nodes.of(contact)

    def _found_on_nodes(self, contact: ContactLoads, age: Array) -> tuple[Mask, FilmLoads]:
        """Compute the result of `on_nodes`. Collective."""
        loads = self._law.loads(contact.pressure, contact.speed, age)
        covered, of_nodes = self._of_nodes(loads, contact)
        if loads.carried is None:
            return covered, of_nodes
        grid, touching, carried = self.ice.grid, contact.touching, loads.carried
        amounts = touching * np.stack(
            [np.ones_like(touching), carried.pressure, carried.cover,
             carried.pressure * carried.softness]
        )  # fmt: skip
        area, force, cover, softer = grid.scatter(amounts, place(grid, contact))[:, grid.own]
        pressure = np.divide(force, area, out=np.zeros_like(force), where=covered)
        softness = np.divide(softer, force, out=np.ones_like(force), where=force > 0.0)
        voids = carried._replace(
            pressure=pressure,
            cover=cover / grid.cell_area[grid.own],
            softness=softness if len(age) else 1.0,
        )
        return covered, of_nodes._replace(carried=voids)

    def _of_nodes(self, loads: FilmLoads, contact: ContactLoads) -> tuple[Mask, FilmLoads]:
        """Mask and loads of the nodes from the loads of the points. Collective."""
        grid, touching = self.ice.grid, contact.touching
        viscous = touching * loads.viscous
        squeeze, free = touching * loads.squeeze_rate, touching * loads.free_height
        amounts = np.stack([touching, viscous, viscous * loads.speed, squeeze, free])
        if loads.rough is not None:
            amounts = np.concatenate([amounts, touching * np.stack(loads.rough)])
        given = grid.scatter(amounts, place(grid, contact))
        area, viscous, power, squeeze, free, *rough = given[:, grid.own]
        covered, cell = area > 0.0, grid.cell_area[grid.own]
        speed = np.divide(power, viscous, out=np.zeros_like(power), where=viscous > 0.0)
        free = np.divide(free, area, out=np.ones_like(free), where=covered)
        of_nodes = loads._replace(
            viscous=viscous / cell, speed=speed, squeeze_rate=squeeze / cell, free_height=free
        )
        if rough:
            shear, warms, exponent = rough
            grows = np.divide(exponent, area, out=np.ones_like(area), where=covered)
            of_nodes = of_nodes._replace(rough=Rough(shear / cell, warms / cell, grows))
        return covered, of_nodes

    def _cover(self, contact: ContactLoads) -> Array:
        """Contact fraction of the cell of each node. Collective."""
        grid = self.ice.grid
        return np.asarray(grid.scatter(contact.touching, place(grid, contact)) / grid.cell_area)

    def shift_window(self, state: InterfaceState, travel: Travel) -> Shifted:
        """Shift ice and films together; leaving ice takes its water along. Collective."""
        grid = self.ice.grid
        cells, rest = whole_cells(grid, travel.offset)
        if cells == 0:
            return Shifted(state, travel.offset)
        ahead = travel.ahead or self._untouched(self._fresh_height, travel.distance - rest)
        before, column = grid.allgather(state.squeezed_height), grid.n_nodes // grid.shape[0]
        water = grid.allgather(ahead.squeezed_height)
        water[: -cells * column] = before[cells * column :]
        # The window ends in the middle of the last cells; the other half enters, too.
        entered, last = slice(-cells * column, None), slice(-column, None)
        rest_of_cells = grid.cell_area[-2 * column : -column] - grid.cell_area[last]
        brought = float(grid.cell_area[entered] @ water[entered] + rest_of_cells @ before[last])
        left = float(grid.cell_area @ (before - water)) + brought
        after = InterfaceState(
            shifted(grid, state.log_height, cells, ahead.log_height),
            water[grid.own],
            self.ice.shifted(state.ice, cells, ahead.ice),
            state.rubber,
            shifted(grid, state.internal, cells, ahead.internal),
            state.age,
        )
        return Shifted(after, rest, left, brought)

    def rested(
        self, state: InterfaceState, end: ContactLoads, start: ContactLoads, begins: PassBegin
    ) -> tuple[InterfaceState, InterfaceState]:
        """State at the start of the next pass, and a window of the ice that enters. Collective.

        All ice is as that which the rubber has left last, from the start of its pass for one
        period. What enters has rested for less by its way to the leading edge. Raises NotConverged.
        """
        grid, law, x = self.ice.grid, self._law, self.ice.grid.lines[0]
        (trailing, leading), (_, begin) = (covered_lines(grid, one) for one in (end, start))
        line = trailing - 1
        left = state._replace(
            log_height=alike(grid, state.log_height, line),
            squeezed_height=alike(grid, state.squeezed_height, line),
            internal=alike(grid, state.internal, line),
            ice=self.ice.alike(state.ice, line),
            rubber=self.rubber.cooled(state.rubber, begins.rest.time),
        )
        ice = self.ice.under(Contacts(grid.own_nodes(), grid.cell_area[grid.own]))
        ways = np.array([x[leading] - x[line], x[-1] - x[begin]])
        passed, enters = (ways / law.first.speed).tolist()
        rest = begins.rest.after(passed)
        at_start, ahead = (
            begins._replace(rest=one).after(left, law, ice) for one in (rest, rest.shorter(enters))
        )
        return at_start, ahead

    @property
    def _x(self) -> Array:
        """Positions (m) of all nodes in the window, along x."""
        grid = self.ice.grid
        return np.repeat(grid.lines[0], grid.n_nodes // grid.shape[0])
