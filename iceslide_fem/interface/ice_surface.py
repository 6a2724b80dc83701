"""The surface of meshed ice within an implicit stage, and points that give heat to it.

The surface's temperatures are an offset and a known, symmetric response R to the heat that its
nodes are given: a diagonal one in the modes (`ice_modes`). What points give falls with the
temperature below them, steeply where they melt, so what remains is the gradient of a convex
function: Newton's method finds it with a line search, each change by conjugate gradients.

It begins with a guess of which nodes melt, from what friction makes before the stage. No node gets
warmer than T_m, and none takes more heat g than friction makes around it:

    T = T_offset + R g,   T <= T_m,   g <= P,   one of them equal at every node.

Dozens of points lie around each node: from there, what they give is found in fewer changes of the
melting set. Where nodes melt, the points' link says how far from T_m they are: by as much as it
takes to pass their flux on.

Both are in `ice_surface.c`, for the points of all ranks: every rank does the same.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cython_blas, cython_lapack

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.native import address, compiled
from iceslide_fem.film.law import FilmStage
from iceslide_fem.interface.ice_modes import SurfaceModes
from iceslide_fem.interface.surface_grid import Placement, SurfaceGrid

MAX_ITERATIONS = 60
UNSETTLED = "the melting part of the ice's surface does not settle"


class SharedPoints:
    """Points of all ranks, `at` their places on the grid; every rank knows them. Collective."""

    def __init__(self, at: Placement, comm: MPI.Comm) -> None:
        self._comm = comm
        self._counts = comm.allgather(len(at.node)) if comm.size > 1 else []
        self.node, self.share = self.of_all(at.node), self.of_all(at.share)

    def of_all(self, own: NDArray[Any]) -> NDArray[Any]:
        """Rows (N, ...) of the points of all ranks, from those (n, ...) of this one. Collective."""
        own = np.ascontiguousarray(own)
        if self._comm.size == 1:
            return own
        rows = np.empty((sum(self._counts), *own.shape[1:]), dtype=own.dtype)
        each = rows[:1].size
        self._comm.Allgatherv(own, [rows, [count * each for count in self._counts]])
        return rows


def fluxes(film: FilmStage, asked: Array, area: Array, link: float, T_m: float) -> Array:
    """Heat (W) that points give to ice whose temperature is near that at which they were `asked`.

    Each gives the smaller of two lines, a heat there less its fall (W/K) times how much warmer (K)
    it is: heat, fall, other heat, other fall, (n, 4). A film of one viscosity below rubber that
    takes no heat keeps to them: it gives all its power, or what holds the ice at T_m through the
    link (K m2/W).
    """
    conductance = area / link
    most = np.where(film.melting, film.dry_temperature, T_m) - asked
    lines = (area * film.ice_flux, conductance * film.ice_slope, conductance * most)
    return np.stack([*lines, conductance * ~film.melting], axis=-1)


class StageSurface(NamedTuple):
    """The surface in a stage, above which are the `points`.

    offset: temperatures of the nodes without heat, K; resistance: of the lateral modes, K m2/W;
    both of the grid's shape.
    """

    points: SharedPoints
    offset: Array
    resistance: Array


class Balance(NamedTuple):
    """Temperatures (K) of the nodes and what the points give to them (W), of the grid's shape.

    settled: the points give what they were asked for; depends: that was found, and is another where
    it is warmer; changes: of the temperatures.
    """

    temperature: Array
    given: Array
    settled: bool
    depends: bool
    changes: int


class IceSurface:
    """The surface of ice that conducts along its `grid` by the `modes`."""

    def __init__(self, grid: SurfaceGrid, modes: SurfaceModes) -> None:
        """Collective."""
        self._kernel = kernel = compiled(Path(__file__).with_name("ice_surface.c"), grid.comm)
        solvers = (cython_blas, "dgemm"), (cython_lapack, "dpbtrf"), (cython_lapack, "dpbtrs")
        addresses = (address(module, name) for module, name in solvers)
        kernel.lib.lapack(*(kernel.ffi.cast("void *", place) for place in addresses))
        self._shape = grid.shape
        nx, ny = (*grid.shape, 1)[:2]
        matrices = {
            f"{axis}_{kind}": getattr(line, kind)
            for axis, line in zip("xy", modes.lines, strict=False)
            for kind in ("vectors", "inverse")
        }
        self._fields = {"nx": nx, "ny": ny, "n": nx * ny}
        self._fields |= self._numbers(cell_area=grid.cell_area, **matrices)

    def melting_guess(
        self, stage: StageSurface, before: Array, power: Array, link: float, T_m: float
    ) -> Array:
        """Temperature (K) of the nodes, of the grid's shape, from that `before` the stage.

        power: of the friction at all points, W, and the area of each, m2, (2, n); link: K m2/W.
        """
        surface, _kept = self._in(stage)
        temperature = before.copy()
        powers, areas = (self._kernel.ffi.from_buffer("double[]", row) for row in power)
        out = self._kernel.ffi.from_buffer("double[]", temperature)
        if self._kernel.lib.melting_guess(surface, powers, areas, link, T_m, out):
            raise MemoryError
        return temperature

    def balanced(
        self, stage: StageSurface, fluxes: Array, asked: Array, agreement: float, within: float
    ) -> Balance:
        """The balance with these `fluxes` of all points (n, 4), `asked` at temperatures (K) of the
        nodes: those, where all agree by so much (K), else one `within` a closer limit.

        Raises NotConverged.
        """
        ffi, lib = self._kernel.ffi, self._kernel.lib
        surface, _kept = self._in(stage)
        temperature, given = asked.copy(), np.empty(self._shape)
        changes = ffi.new("int *")
        outcome = lib.balance(
            surface,
            ffi.from_buffer("Fluxes[]", fluxes),
            agreement,
            within,
            MAX_ITERATIONS,
            ffi.from_buffer("double[]", temperature),
            ffi.from_buffer("double[]", given),
            changes,
        )
        if outcome == lib.FAILED:
            raise NotConverged("the linear solver of the ice's temperature fails")
        if outcome == lib.UNSETTLED:
            raise NotConverged(UNSETTLED)
        settled, depends = outcome == lib.SETTLED, outcome == lib.CHANGED
        return Balance(temperature, given, settled, depends, changes[0])

    def _in(self, stage: StageSurface) -> tuple[Any, Any]:
        """The surface as C has it, and what has to live as long."""
        points = stage.points
        n, corners = points.node.shape
        node = self._kernel.ffi.from_buffer("int[]", points.node)
        at = {"n": n, "corners": corners, "node": node, **self._numbers(share=points.share)}
        below = self._kernel.ffi.new("Points *", at)
        arrays = self._numbers(offset=stage.offset, resistance=stage.resistance)
        fields = {**self._fields, **arrays, "points": below}
        return self._kernel.ffi.new("Surface *", fields), (at, fields)

    def _numbers(self, **arrays: Array) -> dict[str, Any]:
        """Arrays as C has them."""
        from_buffer = self._kernel.ffi.from_buffer
        return {
            name: from_buffer("double[]", np.ascontiguousarray(array))
            for name, array in arrays.items()
        }
