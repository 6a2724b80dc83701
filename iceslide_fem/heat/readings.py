"""Interpolation from unknowns to points, and transfer of heat from points to unknowns."""

from __future__ import annotations

from copy import copy

import numpy as np
from scipy.sparse import csr_matrix

from iceslide_fem.fenics.compat import PETSc
from iceslide_fem.runtime.arrays import Array, Index


class Readings:
    """Interpolation matrix P of this rank's points: temperatures P w, heat P^T q.

    For two bodies, the rows of the first are followed by those of the second.
    """

    def __init__(self, matrix: PETSc.Mat, bodies: int = 1) -> None:
        """Readings by a `matrix` from this number of `bodies`. Collective."""
        self._matrix, self._bodies = matrix, bodies
        self._unknowns, self._points = matrix.createVecs()
        number, weight = _padded(*matrix.getValuesCSR())
        numbers, place = np.unique(number, return_inverse=True)
        place = place.reshape(number.shape)
        # pairs of coupled readings: of a point with itself, and across its film
        pairs = []
        for body in range(bodies):
            other = np.roll(np.arange(len(number)), body * (len(number) // 2))
            product = weight[:, :, None] * weight[other][:, None]
            entry = place[:, :, None] * numbers.size + place[other][:, None]
            there = np.nonzero(product)
            pairs.append((product[there], entry[there], body * len(number) + there[0]))
        product, entry, slope = (np.concatenate(one) for one in zip(*pairs, strict=True))
        entries, entry = np.unique(entry, return_inverse=True)
        shape = entries.size, bodies * len(number)
        self._couples = csr_matrix((product, (entry, slope)), shape=shape)
        rows, columns = np.divmod(entries, max(numbers.size, 1))
        rows, counts = np.unique(rows, return_counts=True)
        self._rows, self._columns = (numbers[one].astype(PETSc.IntType) for one in (rows, columns))
        self._starts = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
        self._some: Index | slice = slice(None)

    def among(self, points: Index) -> Readings:
        """The same for some of the points only, by number."""
        some = copy(self)
        some._some = points
        return some

    def of(self, values: Array) -> Array:
        """Values (n,) of this rank's points. Collective."""
        self._unknowns.array[:] = values
        self._matrix.mult(self._unknowns, self._points)
        return np.array(self._points.array[self._some])

    def given(self, values: Array) -> Array:
        """Sums at the unknowns of the points' `values` (n,). Collective."""
        self._points.array[:] = 0.0
        self._points.array[self._some] = values
        self._matrix.multTranspose(self._points, self._unknowns)
        return np.array(self._unknowns.array)

    def couple(self, matrix: PETSc.Mat, slopes: Array) -> None:
        """Add P^T S P to a matrix with these entries. Collective.

        slopes: of the heat of each point with its temperature, and with that of the other body, if
        there are two, (bodies, n).
        """
        of_all = np.zeros((self._bodies, self._points.getLocalSize()))
        of_all[:, self._some] = slopes
        values = self._couples @ of_all.ravel()
        matrix.setValuesIJV(self._starts, self._columns, values, addv=True, rowmap=self._rows)
        matrix.assemble()

    def widened(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """The matrix with additional entries where films couple unknowns. Collective."""
        first, last = self._matrix.getOwnershipRange()
        size, n = (last - first, PETSc.DETERMINE), last - first
        columns = np.stack([np.roll(np.arange(n), k * n // 2) for k in range(self._bodies)], axis=1)
        starts = self._bodies * np.arange(n + 1)
        csr = starts.astype(PETSc.IntType), (first + columns.ravel()).astype(PETSc.IntType)
        between = PETSc.Mat().createAIJ(
            (size, size), csr=(*csr, np.ones(columns.size)), comm=self._matrix.comm
        )
        weighed = between.matMult(self._matrix)
        falls = self._matrix.transposeMatMult(weighed)
        falls.zeroEntries()
        wide = matrix.copy()
        wide.axpy(1.0, falls, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        for one in (between, weighed, falls):
            one.destroy()
        return wide


def _padded(starts: Array, columns: Array, weights: Array) -> tuple[Array, Array]:
    """Columns and weights of rows of varying length, padded to arrays (rows, longest)."""
    counts = np.diff(starts)
    there = np.arange(counts.max(initial=0)) < counts[:, None]
    number, weight = np.zeros(there.shape, dtype=columns.dtype), np.zeros(there.shape)
    number[there], weight[there] = columns, weights
    return number, weight
