"""The unknowns as points read them, and what the points give to the unknowns."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import PETSc


class Readings:
    """A matrix P whose rows weigh unknowns for this rank's points: temperatures P w, heat P^T q."""

    def __init__(self, matrix: PETSc.Mat) -> None:
        """What a `matrix` reads. Collective."""
        self._matrix = matrix
        self._unknowns, self._points = matrix.createVecs()
        starts, columns, weights = matrix.getValuesCSR()
        self._numbers, places = np.unique(columns, return_inverse=True)
        shape = len(starts) - 1, len(self._numbers)
        self._own = csr_matrix((weights, places, starts), shape=shape)

    def of(self, values: Array) -> Array:
        """Values (n,) of this rank's points. Collective."""
        self._unknowns.array[:] = values
        self._matrix.mult(self._unknowns, self._points)
        return np.array(self._points.array)

    def given(self, values: Array) -> Array:
        """What the unknowns get of the points' `values` (n,). Collective."""
        self._points.array[:] = values
        self._matrix.multTranspose(self._points, self._unknowns)
        return np.array(self._unknowns.array)

    def couple(self, matrix: PETSc.Mat, slopes: csr_matrix) -> None:
        """Add P^T S P to a matrix, with the `slopes` S between this rank's points. Collective."""
        falls = (self._own.T @ (slopes @ self._own)).tocsr()
        rows, columns = (self._numbers.astype(PETSc.IntType)[n] for n in (..., falls.indices))
        starts = falls.indptr.astype(PETSc.IntType)
        matrix.setValuesIJV(starts, columns, falls.data, addv=True, rowmap=rows)
        matrix.assemble()

    def widened(self, matrix: PETSc.Mat, slopes: csr_matrix) -> PETSc.Mat:
        """The same matrix with entries wherever P^T S P has some. Collective."""
        first, last = self._matrix.getOwnershipRange()
        columns = (first + slopes.indices).astype(PETSc.IntType)
        csr = slopes.indptr.astype(PETSc.IntType), columns, slopes.data
        size = last - first, PETSc.DETERMINE
        between = PETSc.Mat().createAIJ((size, size), csr=csr, comm=self._matrix.comm)
        weighed = between.matMult(self._matrix)
        falls = self._matrix.transposeMatMult(weighed)
        falls.zeroEntries()
        wide = matrix.copy()
        wide.axpy(1.0, falls, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        for one in (between, weighed, falls):
            one.destroy()
        return wide
