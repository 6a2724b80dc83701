"""PETSc's matrices and this rank's own values."""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import PETSc


def product(matrix: PETSc.Mat, values: Array) -> Array:
    """A matrix times this rank's `values`. Collective."""
    right, left = matrix.createVecs()
    right.array[:] = values
    matrix.mult(right, left)
    found = left.array.copy()
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
