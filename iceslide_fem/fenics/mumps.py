"""MUMPS's factors in single precision, by its own interface."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.native import compiled, ints

# MUMPS estimates the room for its factors before it knows the pivots and which rank takes what:
# so much is added to the estimate, in per cent, and doubled until it is enough.
ROOM, MORE_ROOM, MOST_ROOM = 100, 200, 1600
NO_ROOM = (-8, -9)  # MUMPS's errors: too small a workspace of integers, of reals
SOURCE = Path(__file__).with_name("mumps.c")

Singles = NDArray[np.float32]
Places = NDArray[np.int32]  # rows or columns


def mumps(comm: MPI.Comm) -> Any:
    """The compiled functions of `mumps.h`. Collective."""
    return compiled([SOURCE], comm, ("smumps",))


def check(error: int) -> None:
    """Raise NotConverged for an error of MUMPS's."""
    if error:
        raise NotConverged(f"the linear solver fails (MUMPS's error {error})")


class SparseColumns(NamedTuple):
    """Columns by their entries: those of column k are first[k] to first[k + 1] of rows (global
    numbers, int32) and values.
    """

    first: Places
    rows: Places
    values: Array

    @classmethod
    def none(cls) -> SparseColumns:
        """No columns."""
        return cls(np.zeros(1, dtype=np.int32), np.zeros(0, dtype=np.int32), np.zeros(0))


class SpreadMatrix(NamedTuple):
    """Where a matrix has entries: starts of the ranks of `comm` among its rows, and at the end
    their number; rows and columns (global numbers) of this rank's entries; points (n, d) of this
    rank's nodes, each with as many components, one after the other.
    """

    comm: MPI.Comm
    starts: NDArray[np.int32]
    rows: Places
    columns: Places
    points: Array
    components: int


class Mumps:
    """Factors of a matrix by its entries on the ranks of `comm`, each rank with some of them.

    Loads and solutions are on the first rank, of all unknowns. Methods are collective, and return
    MUMPS's error, the same on all ranks: 0 if it has none.
    """

    def __init__(self, module: Any, comm: MPI.Comm) -> None:
        """`module`: `mumps`. Raises MemoryError where there is no room."""
        self._lib, self._ffi, self._first = module.lib, module.ffi, comm.rank == 0
        self._entries: tuple[Places, ...] = ()
        self._values: Singles = np.zeros(0, dtype=np.float32)
        # Where unknowns are left, what the others add to their equations, by `factorise`.
        self.added: Singles = np.zeros((0, 0), dtype=np.float32)
        self._left: tuple[Places, ...] = ()  # those unknowns, from 1, and the order of all
        self.room = ROOM  # beyond MUMPS's estimate, %
        self._factors: Any = self._lib.begin(comm.py2f())
        if not comm.allreduce(self._factors != self._ffi.NULL, op=MPI.LAND):
            raise MemoryError("there is no room for factors")

    def analyse(self, unknowns: int, rows: Places, columns: Places) -> int:
        """Order the unknowns of a matrix with entries at `rows` and `columns`, from 0."""
        return int(self._lib.analyse(self._factors, *self._placed(unknowns, rows, columns)))

    def analyse_inner(
        self, unknowns: int, rows: Places, columns: Places, order: Places, left: Places
    ) -> int:
        """The same if those unknowns `left`, from 0, are not eliminated, and all have places in an
        `order`, from 1; on one rank.
        """
        given = self._placed(unknowns, rows, columns)
        self.added = np.zeros((left.size, left.size), dtype=np.float32)
        self._left = left + np.int32(1), order
        named, places = map(self._ints, self._left)
        inner = places, left.size, named, self._floats(self.added)
        return int(self._lib.analyse_inner(self._factors, *given, *inner))

    def factorise(self, values: Singles) -> int:
        """Factors of the entries' `values`."""
        self._values = values
        error = self._lib.factorise(self._factors, self._floats(values), self.room)
        while error in NO_ROOM and self.room < MOST_ROOM:
            self.room = max(2 * self.room, MORE_ROOM)
            error = self._lib.factorise(self._factors, self._floats(values), self.room)
        return int(error)

    @property
    def replaced(self) -> int:
        """How many pivots were too small and are not the matrix's own: where unknowns are left."""
        return int(self._lib.replaced(self._factors))

    def solve(self, load: Singles) -> int:
        """Solve for a `load` (n), which the solution replaces."""
        return int(self._lib.solve(self._factors, self._on_first(self._floats(load))))

    def solve_many(self, first: Places, rows: Places, values: Singles, solutions: Singles) -> int:
        """The `solutions` (k, n) for loads of which load k has `values` in `rows`, from 0, from
        first[k] to first[k + 1]. The first pass through the factors goes only where they are.
        """
        arrays = *self._sparse(first, rows, values), self._floats(solutions)
        given = len(first) - 1, *map(self._on_first, arrays)
        return int(self._lib.solve_many(self._factors, *given))

    def condense(self, load: Singles, condensed: Singles) -> int:
        """What of a `load` (n) comes to the unknowns left, `condensed` (left)."""
        arrays = self._floats(load), self._floats(condensed)
        return int(self._lib.condense(self._factors, *arrays))

    def condense_many(
        self, first: Places, rows: Places, values: Singles, condensed: Singles
    ) -> int:
        """The same for some sparse loads as of `solve_many`, `condensed` (k, left)."""
        arrays = *self._sparse(first, rows, values), self._floats(condensed)
        return int(self._lib.condense_many(self._factors, len(first) - 1, *arrays))

    def expand(self, found: Singles, solutions: Singles) -> int:
        """The `solutions` (k, n) for the loads that were last condensed, from those `found` for the
        unknowns left (k, left).
        """
        given = len(found), self._floats(found), self._floats(solutions)
        return int(self._lib.expand(self._factors, *given))

    def end(self) -> None:
        """Give the memory back."""
        self._lib.end(self._factors)

    def _placed(self, unknowns: int, rows: Places, columns: Places) -> tuple[Any, ...]:
        """A matrix as MUMPS wants it."""
        self._entries = rows + np.int32(1), columns + np.int32(1)  # it counts from 1
        return unknowns, len(rows), *map(self._ints, self._entries)

    def _sparse(self, first: Places, rows: Places, values: Singles) -> tuple[Any, ...]:
        """Sparse loads as MUMPS wants them."""
        places = first + np.int32(1), rows + np.int32(1)
        return (*map(self._ints, places), self._floats(values))

    def _on_first(self, array: Any) -> Any:
        """Of loads and solutions MUMPS wants nothing on the other ranks."""
        return array if self._first else self._ffi.NULL

    def _ints(self, values: Places) -> Any:
        return self._ffi.from_buffer("int[]", ints(values))

    def _floats(self, values: Singles) -> Any:
        return self._ffi.from_buffer("float[]", values)
