"""PETSc matrices applied to this rank's values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.runtime.arrays import Array

NOTHING = 1e-12  # a weight below this is 0; weights have the sum 1


def rows_of(numbers: NDArray[np.int64], weights: Array, columns: int, comm: MPI.Comm) -> PETSc.Mat:
    """Matrix with rows (n, few) of weights for the columns `numbers`. Collective.

    columns: number of columns that this rank owns. Zero weights are dropped.
    """
    counts = np.abs(weights) > NOTHING
    starts = np.concatenate([[0], np.cumsum(counts.sum(axis=1))]).astype(PETSc.IntType)
    return PETSc.Mat().createAIJ(
        ((len(counts), PETSc.DETERMINE), (columns, PETSc.DETERMINE)),
        csr=(starts, numbers[counts].astype(PETSc.IntType), weights[counts]),
        comm=comm,
    )


def product(matrix: PETSc.Mat, values: Array) -> Array:
    """A matrix times this rank's `values`. Collective."""
    right, left = matrix.createVecs()
    right.array[:] = values
    matrix.mult(right, left)
    found = left.array.copy()
    right.destroy()
    left.destroy()
    return np.asarray(found)
