"""Points of all ranks on the ice's surface, gathered on every rank on demand."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.interface.surface_grid import Placement
from iceslide_fem.runtime.arrays import Array, Index


class SharedPoints:
    """Points that read from and give to nodes of the surface's grid with the same weights."""

    def __init__(self, at: Placement, shape: tuple[int, ...], comm: MPI.Comm) -> None:
        """at: placement of this rank's points; shape: of the grid. Collective.

        reads: interpolation matrix (N, nodes) of the points of all ranks; gives: its transpose,
        which adds nodal loads.
        """
        self._comm, self._n, own = comm, int(np.prod(shape)), len(at.node)
        self._counts, self._own = comm.allgather(own), own
        self._some: Index | slice = slice(None)
        node, weight = self._gathered(at.node), self._gathered(at.weight)
        starts = node.shape[1] * np.arange(len(node) + 1)
        self.reads = csr_matrix((weight.ravel(), node.ravel(), starts), shape=(len(node), self._n))
        self.gives = self.reads.T.tocsr()
        # largest difference of the node numbers in one cell
        self._width = 1 if len(shape) == 1 else shape[1] + 1
        self._couples = self._coupling(node, weight)

    def among(self, points: Index | None) -> SharedPoints:
        """The same with some of this rank's points, by number; the other points give nothing."""
        if points is None:
            return self
        some = copy(self)
        some._some = points
        return some

    def of_all(self, own: Array) -> Array:
        """Rows (N, ...) of the points of all ranks, from those (n, ...) of this one. Collective."""
        rows = np.zeros((self._own, *own.shape[1:]))
        rows[self._some] = own
        return self._gathered(rows)

    def coupling(self, slopes: Array) -> Array:
        """P^T S P of slopes (N,) in the lower bands (width + 1, nodes) that LAPACK takes."""
        return np.asarray(self._couples @ slopes).reshape(self._width + 1, self._n)

    def _coupling(self, node: NDArray[np.int32], weight: Array) -> csr_matrix:
        """Matrix from slopes of the points to the entries of the nodes' band matrix."""
        apart = node[:, :, None] - node[:, None, :]
        lower = np.nonzero(apart >= 0)
        entry = apart[lower] * self._n + node[lower[0], lower[2]]
        product = weight[lower[0], lower[1]] * weight[lower[0], lower[2]]
        shape = (self._width + 1) * self._n, len(node)
        return csr_matrix((product, (entry, lower[0])), shape=shape)

    def _gathered(self, own: NDArray[Any]) -> NDArray[Any]:
        own = np.ascontiguousarray(own)
        if self._comm.size == 1:
            return own
        rows = np.empty((sum(self._counts), *own.shape[1:]), dtype=own.dtype)
        each = rows[:1].size
        self._comm.Allgatherv(own, [rows, [count * each for count in self._counts]])
        return rows
