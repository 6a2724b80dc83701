"""Points of all ranks on the ice's surface, which every rank knows once they are asked for."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.interface.surface_grid import Placement


class SharedPoints:
    """Points that read nodes of the surface's grid, and give to them with the same weights."""

    def __init__(self, at: Placement, shape: tuple[int, ...], comm: MPI.Comm) -> None:
        """`at`: places of this rank's points; `shape` of the grid."""
        self._at, self._comm, self._n = at, comm, int(np.prod(shape))
        # of the numbers of nodes of one cell, so far apart are they at most
        self.width = 1 if len(shape) == 1 else shape[1] + 1

    @cached_property
    def _counts(self) -> list[int]:
        return self._comm.allgather(len(self._at.node))

    def of_all(self, own: NDArray[Any]) -> NDArray[Any]:
        """Rows (N, ...) of the points of all ranks, from those (n, ...) of this one. Collective."""
        own = np.ascontiguousarray(own)
        if self._comm.size == 1:
            return own
        rows = np.empty((sum(self._counts), *own.shape[1:]), dtype=own.dtype)
        each = rows[:1].size
        self._comm.Allgatherv(own, [rows, [count * each for count in self._counts]])
        return rows

    @cached_property
    def reads(self) -> csr_matrix:
        """Matrix (N, nodes) of the weights by which the points of all ranks read the nodes.

        Collective where it is first asked.
        """
        node, share = self.of_all(self._at.node), self.of_all(self._at.share)
        starts = node.shape[1] * np.arange(len(node) + 1)
        return csr_matrix((share.ravel(), node.ravel(), starts), shape=(len(node), self._n))

    @cached_property
    def gives(self) -> csr_matrix:
        """Matrix (nodes, N) by which the nodes get what the points give."""
        return self.reads.T.tocsr()

    @cached_property
    def _couples(self) -> csr_matrix:
        """From slopes of the points to what they add to a band matrix of the nodes, by entries."""
        points, corners = len(self.reads.indptr) - 1, self._at.node.shape[1]
        node = self.reads.indices.reshape(points, corners)
        share = self.reads.data.reshape(points, corners)
        apart = node[:, :, None] - node[:, None, :]
        lower = np.nonzero(apart >= 0)
        entry = apart[lower] * self._n + node[lower[0], lower[2]]
        product = share[lower[0], lower[1]] * share[lower[0], lower[2]]
        shape = (self.width + 1) * self._n, points
        return csr_matrix((product, (entry, lower[0])), shape=shape)

    def coupling(self, slopes: Array) -> Array:
        """P^T S P of slopes (N,) in the lower bands (width + 1, nodes) that LAPACK takes."""
        return np.asarray(self._couples @ slopes).reshape(self.width + 1, self._n)
