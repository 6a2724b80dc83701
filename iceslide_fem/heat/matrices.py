"""PETSc's matrices and this rank's own values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import MPI, PETSc

NOTHING = 1e-12  # of weights that add up to 1


def rows_of(numbers: NDArray[np.int64], weights: Array, columns: int, comm: MPI.Comm) -> PETSc.Mat:
    """Matrix whose rows (n, few) weigh values by their numbers, of which this rank has `columns`.

    What weighs nothing is left out. Collective.
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


def transposed_product(matrix: PETSc.Mat, values: Array) -> Array:
    """The transpose of a matrix times this rank's `values`. Collective."""
    right, left = matrix.createVecs()
    left.array[:] = values
    matrix.multTranspose(left, right)
    found = right.array.copy()
    right.destroy()
    left.destroy()
    return np.asarray(found)


def add(matrix: PETSc.Mat, few: PETSc.Mat) -> None:
    """Add `few` to a matrix that has its entries; most of its rows are empty. Collective."""
    starts, columns, values = few.getValuesCSR()
    rows = np.flatnonzero(np.diff(starts)).astype(PETSc.IntType)
    starts = np.append(starts[rows], starts[-1]).astype(PETSc.IntType)
    numbers = matrix.getOwnershipRange()[0] + rows
    matrix.setValuesIJV(starts, columns, values, addv=True, rowmap=numbers)
    matrix.assemble()


def set_diagonal(matrix: PETSc.Mat, values: Array) -> None:
    diagonal = matrix.createVecRight()
    diagonal.array[:] = values
    matrix.setDiagonal(diagonal)
    diagonal.destroy()
