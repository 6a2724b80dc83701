"""MUMPS's factors in single precision, as PETSc's preconditioner."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.halved_factors import HalvedFactors, separator
from iceslide_fem.fenics.mumps import SparseColumns, SpreadMatrix, mumps
from iceslide_fem.fenics.native import ints
from iceslide_fem.fenics.shared_factors import SharedFactors


class SingleFactors:
    """What `PETSc.PC.setPythonContext` takes: `setUp`, `apply` and `destroy` are PETSc's to call.

    Two ranks have a half of the rubber each (`halved_factors`), more share the factors of all of it
    (`shared_factors`), and so do two where a half has no good pivots of its own.
    """

    def __init__(self, comm: MPI.Comm, points: Array) -> None:
        """`points`: (n, d) of this rank's nodes. Collective: compiles."""
        self._comm, self._points, self._module = comm, points, mumps(comm)
        self._factors: SharedFactors | HalvedFactors | None = None
        self._pattern: tuple[NDArray[Any], ...] = ()  # of this rank: first entries, columns

    @property
    def room(self) -> int:
        """What MUMPS has been given beyond its estimate, %."""
        return self._known.mumps.room

    def setUp(self, pc: PETSc.PC) -> None:  # noqa: N802 (PETSc's name)
        """Factorise the operator's matrix. Raises NotConverged where MUMPS cannot. Collective."""
        _, matrix = pc.getOperators()
        first, columns, values = matrix.getValuesCSR()
        pattern = ints(first), ints(columns)
        singles = values.astype(np.float32)
        known = self._factors is not None and all(map(np.array_equal, pattern, self._pattern))
        if not self._comm.allreduce(known, op=MPI.LAND):
            self._pattern = pattern
            self.destroy(None)
            self._factors = self._ordered(self._entries(matrix, *pattern))
        if not self._known.factorise(singles):
            self.destroy(None)
            self._factors = SharedFactors(self._module, self._entries(matrix, *pattern))
            self._factors.factorise(singles)

    def apply(self, _: PETSc.PC, load: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve with the factors. Raises NotConverged where MUMPS cannot. Collective."""
        solution.array[:] = self._known.solve(load.array_r.astype(np.float32))

    def solve_many(self, loads: SparseColumns) -> Array:
        """Solutions (k, n) of this rank's unknowns for sparse `loads`, which every rank has.

        Raises NotConverged where MUMPS cannot. Collective.
        """
        return self._known.solve_many(loads).astype(np.float64)

    def destroy(self, _: PETSc.PC | None) -> None:
        """Give the factors' memory back. Collective."""
        if self._factors is not None:
            self._factors.end()
            self._factors = None

    @property
    def _known(self) -> SharedFactors | HalvedFactors:
        if self._factors is None:
            raise RuntimeError("there are no factors before there is a matrix")
        return self._factors

    def _ordered(self, matrix: SpreadMatrix) -> SharedFactors | HalvedFactors:
        """The factors to be of a `matrix`, of which MUMPS has to know this only once."""
        if self._comm.size == 2:
            border = separator(matrix)
            if 0 < border.size < np.diff(matrix.starts).min():
                return HalvedFactors(self._module, matrix, border)
        return SharedFactors(self._module, matrix)

    def _entries(
        self, matrix: PETSc.Mat, first: NDArray[Any], columns: NDArray[Any]
    ) -> SpreadMatrix:
        """Where `matrix` has its entries, of which each rank knows its rows'."""
        rows = np.arange(*matrix.getOwnershipRange(), dtype=np.int32)
        places = np.repeat(rows, np.diff(first)), columns
        starts, components = matrix.getOwnershipRanges(), matrix.getBlockSize()
        return SpreadMatrix(self._comm, starts, *places, self._points, components)
