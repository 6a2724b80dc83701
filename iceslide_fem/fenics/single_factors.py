"""MUMPS's factors in single precision, as PETSc's preconditioner."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.native import compiled

# MUMPS estimates the room for its factors before it knows the pivots and which rank takes what:
# so much is added to the estimate, in per cent, and doubled until it is enough.
ROOM, MORE_ROOM, MOST_ROOM = 100, 200, 1600
NO_ROOM = (-8, -9)  # MUMPS's errors: too small a workspace of integers, of reals
SOURCE = Path(__file__).with_name("single_factors.c")
_Single = NDArray[np.float32]


class SparseColumns(NamedTuple):
    """Columns by their entries: those of column k are first[k] to first[k + 1] of rows (global
    numbers, int32) and values.
    """

    first: NDArray[np.int32]
    rows: NDArray[np.int32]
    values: Array

    @classmethod
    def none(cls) -> SparseColumns:
        """No columns."""
        return cls(np.zeros(1, dtype=np.int32), np.zeros(0, dtype=np.int32), np.zeros(0))


class SingleFactors:
    """What `PETSc.PC.setPythonContext` takes: `setUp`, `apply` and `destroy` are PETSc's to call.

    Loads and solutions pass through the first rank, which MUMPS wants to have all of them.
    """

    def __init__(self, comm: MPI.Comm) -> None:
        """Collective: compiles."""
        module = compiled([SOURCE], comm, ("smumps",))
        self._comm, self._lib, self._ffi = comm, module.lib, module.ffi
        self._factors: Any = None
        self._pattern: tuple[NDArray[Any], ...] = ()  # of this rank: first entries, columns
        self._entries: tuple[NDArray[np.int32], ...] = ()  # rows and columns, from 1
        self._counts: list[int] = []  # of unknowns on each rank
        self.room = ROOM  # beyond MUMPS's estimate, %

    def setUp(self, pc: PETSc.PC) -> None:  # noqa: N802 (PETSc's name)
        """Factorise the operator's matrix. Raises NotConverged where MUMPS cannot. Collective."""
        _, matrix = pc.getOperators()
        *pattern, values = matrix.getValuesCSR()
        known = self._factors is not None and all(map(np.array_equal, pattern, self._pattern))
        if not self._comm.allreduce(known, op=MPI.LAND):
            self._analyse(matrix, *pattern)
        entries = self._floats(values.astype(np.float32))
        error = self._lib.factorise(self._factors, entries, self.room)
        while error in NO_ROOM and self.room < MOST_ROOM:
            self.room = max(2 * self.room, MORE_ROOM)
            error = self._lib.factorise(self._factors, entries, self.room)
        _check(error)

    def apply(self, _: PETSc.PC, load: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve with the factors. Collective."""
        whole = self._gathered(load.array_r.astype(np.float32))
        _check(self._lib.solve(self._factors, *self._on_first(self._floats(whole))))
        solution.array[:] = self._scattered(whole)

    def solve_many(self, loads: SparseColumns) -> Array:
        """Solutions (k, n) of this rank's unknowns for sparse `loads`, which every rank has.

        The first pass through the factors goes only where the loads are. Collective.
        """
        count = len(loads.first) - 1
        whole = np.zeros((count, self._unknowns_here), dtype=np.float32)
        first, rows = loads.first + 1, loads.rows + 1  # MUMPS counts from 1
        values = loads.values.astype(np.float32)
        given = self._ints(first), self._ints(rows), self._floats(values), self._floats(whole)
        _check(self._lib.solve_many(self._factors, count, *self._on_first(*given)))
        return np.array([self._scattered(one) for one in whole])

    def destroy(self, _: PETSc.PC) -> None:
        """Give the factors' memory back. Collective."""
        if self._factors is not None:
            self._lib.end(self._factors)
            self._factors = None

    def _analyse(self, matrix: PETSc.Mat, first: NDArray[Any], columns: NDArray[Any]) -> None:
        """Order the unknowns of a matrix of this pattern: MUMPS has to know it only once."""
        self.destroy(None)
        self._pattern = first, columns
        self._counts = np.diff(matrix.getOwnershipRanges()).tolist()
        start, stop = matrix.getOwnershipRange()
        rows = np.repeat(np.arange(start + 1, stop + 1, dtype=np.int32), np.diff(first))
        self._entries = rows, columns + np.int32(1)
        self._factors = self._lib.begin(self._comm.py2f())
        if not self._comm.allreduce(self._factors != self._ffi.NULL, op=MPI.LAND):
            raise MemoryError("there is no room for factors")
        unknowns, places = matrix.getSize()[0], map(self._ints, self._entries)
        _check(self._lib.analyse(self._factors, unknowns, len(columns), *places))

    @property
    def _unknowns_here(self) -> int:
        """How many unknowns of loads and solutions are on this rank: all of them on the first."""
        return sum(self._counts) if self._comm.rank == 0 else 0

    def _on_first(self, *arrays: Any) -> tuple[Any, ...]:
        """Of loads and solutions MUMPS wants nothing on the other ranks."""
        return arrays if self._comm.rank == 0 else (self._ffi.NULL,) * len(arrays)

    def _gathered(self, own: _Single) -> _Single:
        if self._comm.size == 1:
            return own
        whole = np.empty(self._unknowns_here, dtype=np.float32)
        self._comm.Gatherv(own, [whole, self._counts])
        return whole

    def _scattered(self, whole: _Single) -> _Single:
        if self._comm.size == 1:
            return whole
        own = np.empty(self._counts[self._comm.rank], dtype=np.float32)
        self._comm.Scatterv([whole, self._counts], own)
        return own

    def _ints(self, values: NDArray[np.int32]) -> Any:
        return self._ffi.from_buffer("int[]", values)

    def _floats(self, values: _Single) -> Any:
        return self._ffi.from_buffer("float[]", values)


def _check(error: int) -> None:
    if error:
        raise NotConverged(f"the linear solver fails (MUMPS's error {error})")
