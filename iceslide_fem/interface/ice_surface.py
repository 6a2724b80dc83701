"""The surface of ice on a grid within an implicit stage, and points anywhere on it that give heat.

The surface's temperatures are an offset and a known, symmetric response R to the heat that its
nodes are given: diagonal in the modes of ice that conducts along it (`ice_modes`), or of each
column alone. What points give falls with the temperature below them, steeply where they melt, so
what remains is the gradient of a convex function: Newton's method finds it with a line search, each
change by conjugate gradients.

It begins with a guess of which nodes melt, from what friction makes before the stage. No node gets
warmer than T_m, and none takes more heat g than friction makes around it:

    T = T_offset + R g,   T <= T_m,   g <= P,   one of them equal at every node.

Dozens of points lie around each node: from there, what they give is found in fewer changes of the
melting set. Where nodes melt, the points' link says how far from T_m they are: by as much as it
takes to pass their flux on.

Guess and balance are in C (`melting_guess.c`, `ice_balance.c`, and `ice_surface.c` for both), for
the points of all ranks: every rank does the same.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cython_blas, cython_lapack

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.native import address, compiled, ints
from iceslide_fem.film.law import Film, FilmOnIce, FilmStage, Surface
from iceslide_fem.interface.ice_modes import SurfaceModes
from iceslide_fem.interface.surface_grid import Contacts, Placement, SurfaceGrid, part_of
from iceslide_fem.materials import Solid

# Of the agreement of ice and film: how closely what the film gives is balanced in between.
BALANCED, MAX_ITERATIONS = 0.1, 60
# Full changes find what films give in a few requests; where they cycle, half of each does.
FULL_CHANGES, MAX_REQUESTS = 12, 60
SOURCES = [
    Path(__file__).with_name(name) for name in ("ice_surface.c", "melting_guess.c", "ice_balance.c")
]
UNSETTLED = "the melting part of the ice's surface does not settle"


class SharedPoints:
    """Points of all ranks, which every rank knows once they are asked for."""

    def __init__(self, at: Placement, comm: MPI.Comm, ffi: Any) -> None:
        """`at`: places of this rank's on the grid; `ffi`: cffi's."""
        self._at, self._comm, self._ffi = at, comm, ffi

    @cached_property
    def _counts(self) -> list[int]:
        return self._comm.allgather(len(self._at.node))

    def of_all(self, own: NDArray[Any]) -> NDArray[Any]:
        """Rows (N, ...) of the points of all ranks, from those (n, ...) of this one. Collective."""
        own = np.ascontiguousarray(own)
        if self._comm.size == 1:
            return own
        rows = np.empty((sum(self._counts), *own.shape[1:]), dtype=own.dtype)
        each = rows[:1].size
        self._comm.Allgatherv(own, [rows, [count * each for count in self._counts]])
        return rows

    @cached_property
    def in_c(self) -> Any:
        """As C has them, which lives as long as these do. Collective where it is first asked."""
        self._node, self._share = self.of_all(self._at.node), self.of_all(self._at.share)
        n, corners = self._node.shape
        node = self._ffi.from_buffer("int[]", ints(self._node))
        share = self._ffi.from_buffer("double[]", self._share)
        fields = {"n": n, "corners": corners, "node": node, "share": share}
        return self._ffi.new("Points *", fields)


def fluxes(film: FilmStage, asked: Array, area: Array, link: float, T_m: float) -> Array:
    """Heat (W) that points give to ice whose temperature is near that at which they were `asked`.

    Each gives the smaller of two lines, a heat there less its fall (W/K) times how much warmer (K)
    it is: heat, fall, other heat, other fall, (n, 4). A film of one viscosity below rubber that
    takes no heat keeps to them: it gives all its power, or what holds the ice at T_m through the
    link (K m2/W).
    """
    conductance, lines = area / link, np.empty((area.size, 4))
    np.multiply(area, film.ice_flux, out=lines[:, 0])
    np.multiply(conductance, film.ice_slope, out=lines[:, 1])
    most = np.where(film.melting, film.dry_temperature, T_m)
    most -= asked
    np.multiply(conductance, most, out=lines[:, 2])
    np.multiply(conductance, ~film.melting, out=lines[:, 3])
    return lines


class StageSurface(NamedTuple):
    """The surface in a stage. offset: temperatures of its nodes without heat, K; resistance: of the
    lateral modes, or of the columns, K m2/W; both of the grid's shape, or one after the other.
    """

    offset: Array
    resistance: Array


class Inside(NamedTuple):
    """The surface in a `stage`, as C has it, and what has to live as long."""

    stage: StageSurface
    surface: Any
    fields: dict[str, Any]


class Balance(NamedTuple):
    """Temperatures (K) of the nodes and what the points give to them (W), shaped as the stage.

    depends: whether any of that has become another because of the temperature; changes: of those.
    """

    temperature: Array
    given: Array
    depends: bool
    changes: int

    @property
    def settled(self) -> bool:
        """Whether the points give what they were asked for."""
        return self.changes == 0


class IceSurface:
    """The surface of ice with points `under` which it answers, and compiled functions for it."""

    def __init__(self, grid: SurfaceGrid, solid: Solid, modes: SurfaceModes | None = None) -> None:
        """Without `modes` nothing is conducted along the `grid`. Nothing touches it yet. at: where
        its points lie. Collective.
        """
        self._grid, self._solid = grid, solid
        self._kernel = kernel = compiled(SOURCES, grid.comm)
        solvers = (cython_blas, "dgemm"), (cython_lapack, "dpbtrf"), (cython_lapack, "dpbtrs")
        addresses = (address(module, name) for module, name in solvers)
        kernel.lib.lapack(*(kernel.ffi.cast("void *", place) for place in addresses))
        nx, ny = (*grid.shape, 1)[:2]
        matrices = {
            f"{axis}_{kind}": getattr(line, kind)
            for axis, line in zip("xy", modes.lines if modes else (), strict=False)
            for kind in ("vectors", "inverse")
        }
        self._fields = {"nx": nx, "ny": ny, "n": nx * ny}
        self._fields |= self._numbers(cell_area=grid.cell_area, **matrices)
        self._place(Contacts(grid.own_nodes(), np.zeros(grid.own.size)))

    def under(self, contacts: Contacts) -> IceSurface:
        """The same surface below `contacts`. Collective."""
        below = copy(self)
        below._place(contacts)
        return below

    def _place(self, contacts: Contacts) -> None:
        self.at, self._area = at, area = contacts.placed, contacts.area
        touching, place = np.flatnonzero(area > 0.0), at
        self._touching: NDArray[np.intp] | slice = slice(None)
        if touching.size < area.size:
            self._touching, place = touching, part_of(at, touching.tobytes())
        self._points = SharedPoints(place, self._grid.comm, self._kernel.ffi)

    def settled(
        self, stage: StageSurface, before: Array, film: Film, link: float, agreement: float
    ) -> tuple[Array, FilmStage]:
        """What the points give to the nodes (W, shaped as the stage), and the film. Collective.

        Where a point melts (or the rubber takes heat, too), its flux depends on the temperature:
        ice and the film's `fluxes` are balanced, and the film is asked again at the temperatures
        found, until both agree within so much (K). The first time it is asked at those of a guess,
        from those `before` the stage and what friction makes there.

        link: between points and ice, K m2/W. Raises NotConverged.
        """
        grid, at, area, T_m = self._grid, self.at, self._area, self._solid.melting_temperature
        touching, of_all, inside = self._touching, self._points.of_all, self.inside(stage)
        temperature, near, links = before, None, np.full(area.shape, link)
        if isinstance(film, FilmOnIce):
            power = of_all(np.stack([area * film.power, area], axis=-1)[touching])
            temperature = self.melting_guess(inside, before, power, link)
        below = grid.interpolate(temperature.ravel(), at)
        for iteration in range(MAX_REQUESTS):
            result = film.solve(Surface.of(below, links, self._solid), near)
            near = result.log_height
            lines = of_all(fluxes(result, below, area, link, T_m)[touching])
            balance = self.balanced(inside, lines, temperature, agreement)
            if balance.settled:
                return balance.given, result
            share = 1.0 if iteration < FULL_CHANGES or not balance.depends else 0.5
            temperature = temperature + share * (balance.temperature - temperature)
            asked, below = below, grid.interpolate(temperature.ravel(), at)
            if not balance.depends:  # the film would say the same again, but for this
                dry = result.dry_temperature + (below - asked)
                return balance.given, result._replace(dry_temperature=dry)
        raise NotConverged(UNSETTLED)

    def melting_guess(self, inside: Inside, before: Array, power: Array, link: float) -> Array:
        """Temperature (K) of the nodes, shaped as that `before` the stage.

        power: of the friction at all points, W, and the area of each, m2, (n, 2); link: K m2/W.
        """
        numbers, T_m = self._kernel.ffi.from_buffer, self._solid.melting_temperature
        temperature, powers = before.copy(), np.ascontiguousarray(power.T)
        rows = (numbers("double[]", row) for row in powers)
        out = numbers("double[]", temperature)
        if self._kernel.lib.melting_guess(inside.surface, *rows, link, T_m, out):
            raise MemoryError
        return temperature

    def balanced(self, inside: Inside, fluxes: Array, asked: Array, agreement: float) -> Balance:
        """The balance with these `fluxes` of all points (n, 4), `asked` at temperatures (K) of the
        nodes: those, where all agree by so much (K), else one within a share of it.

        Raises NotConverged.
        """
        ffi, lib = self._kernel.ffi, self._kernel.lib
        temperature, given, changes = asked.copy(), np.empty_like(asked), ffi.new("int *")
        outcome = lib.balance(
            inside.surface,
            ffi.from_buffer("Fluxes[]", fluxes),
            agreement,
            BALANCED * agreement,
            MAX_ITERATIONS,
            ffi.from_buffer("double[]", temperature),
            ffi.from_buffer("double[]", given),
            changes,
        )
        if outcome == lib.FAILED:
            raise NotConverged("the linear solver of the ice's temperature fails")
        if outcome == lib.UNSETTLED:
            raise NotConverged(UNSETTLED)
        return Balance(temperature, given, outcome == lib.DEPENDS, changes[0])

    def inside(self, stage: StageSurface) -> Inside:
        """The surface in a stage, for `melting_guess` and `balanced`. Collective."""
        fields = {**self._fields, **self._numbers(**stage._asdict()), "points": self._points.in_c}
        return Inside(stage, self._kernel.ffi.new("Surface *", fields), fields)

    def _numbers(self, **arrays: Array) -> dict[str, Any]:
        """Arrays as C has them, which live as long as these do."""
        from_buffer = self._kernel.ffi.from_buffer
        return {
            name: from_buffer("double[]", np.ascontiguousarray(array))
            for name, array in arrays.items()
        }
