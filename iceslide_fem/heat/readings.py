"""The unknowns as points read them, and what the points give to the unknowns."""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import PETSc


class Readings:
    """A matrix P whose rows weigh unknowns for this rank's points: temperatures P w, heat P^T q.

    Where points read two bodies, the rows of one come after those of the other.
    """

    def __init__(self, matrix: PETSc.Mat, bodies: int = 1) -> None:
        """What a `matrix` reads of so many bodies. Collective."""
        self._matrix, self._bodies = matrix, bodies
        self._unknowns, self._points = matrix.createVecs()
        number, weight = _padded(*matrix.getValuesCSR())
        # pairs of readings that follow each other's temperature: of a point, and across its film
        others = [np.arange(len(number)), np.roll(np.arange(len(number)), len(number) // 2)]
        first = np.stack([number] * bodies)[:, :, :, None]
        second = np.stack([number[other] for other in others[:bodies]])[:, :, None, :]
        product = np.stack([weight[:, :, None] * weight[o][:, None] for o in others[:bodies]])
        counts = product != 0.0
        self._product, self._slope = product[counts], np.nonzero(counts)[:2]
        places = np.stack([np.broadcast_to(one, counts.shape)[counts] for one in (first, second)])
        entries, self._entry = np.unique(places, axis=1, return_inverse=True)
        self._rows, counted = np.unique(entries[0], return_counts=True)
        self._starts = np.concatenate([[0], np.cumsum(counted)]).astype(PETSc.IntType)
        self._columns = entries[1].astype(PETSc.IntType)

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

    def couple(self, matrix: PETSc.Mat, slopes: Array) -> None:
        """Add P^T S P to a matrix with these entries. Collective.

        slopes: of what each point gets with its own temperature, and with that of the other body,
        where there are two, (bodies, n).
        """
        values = self._product * slopes[self._slope]
        values = np.bincount(self._entry, values, len(self._columns))
        matrix.setValuesIJV(self._starts, self._columns, values, addv=True, rowmap=self._rows)
        matrix.assemble()

    def widened(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """The same matrix with entries wherever films couple unknowns. Collective."""
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
    """Columns and weights of rows of any lengths as arrays (rows, longest), filled with nothing."""
    counts = np.diff(starts)
    there = np.arange(counts.max(initial=0)) < counts[:, None]
    number, weight = np.zeros(there.shape, dtype=columns.dtype), np.zeros(there.shape)
    number[there], weight[there] = columns, weights
    return number, weight
