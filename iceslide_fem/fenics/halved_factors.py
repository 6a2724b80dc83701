"""Factors of a matrix of which each of two ranks has a half.

Unknowns are those inside each half and those on the border between, which nothing inside passes.
Each rank eliminates what is inside its own half by itself, and both solve for the border, whose
equations are dense then (substructuring: J. S. Przemieniecki, AIAA J. 1 (1963) 138). A solve passes
messages once, of the length of the border, where factors that are shared out do at every front.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg.lapack import sgetrf, sgetrs
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_bipartite_matching

from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.dissection import dissected
from iceslide_fem.fenics.mumps import (
    Mumps,
    Places,
    Singles,
    SparseColumns,
    SpreadMatrix,
    check,
)


class HalvedFactors:
    """Factors of a matrix on two ranks. All methods are collective."""

    def __init__(self, module: Any, matrix: SpreadMatrix, border: Places) -> None:
        """Orders the unknowns of `matrix` by the compiled `module`; `border`: those between the
        halves (`separator`). Raises NotConverged.
        """
        self._comm = matrix.comm
        start, stop = matrix.starts[self._comm.rank :][:2]
        self._own = slice(start, stop)
        # the unknowns of this half: this rank's, then those of the border that are not
        number = np.full(matrix.starts[-1], -1, dtype=np.int32)
        number[self._own] = np.arange(stop - start)
        beyond = border[number[border] < 0]
        number[beyond] = np.arange(stop - start, stop - start + beyond.size)
        self._size, self._n_border = stop - start + beyond.size, border.size
        # entries of the border's own rows and what is inside the other half are for the other rank
        self._abroad = number[matrix.columns] < 0
        sent = matrix.rows[self._abroad], matrix.columns[self._abroad]
        kept = matrix.rows[~self._abroad], matrix.columns[~self._abroad]
        rows, columns = (
            number[np.concatenate(both)] for both in zip(kept, self._exchanged(sent), strict=True)
        )
        order = _order(matrix, rows, columns, number[border], self._size)
        self.mumps = Mumps(module, MPI.COMM_SELF)
        self._check(self.mumps.analyse_inner(self._size, rows, columns, order, number[border]))
        self._border: tuple[Any, Any] = (None, None)  # factors of its matrix, and their pivots

    def factorise(self, values: Singles) -> bool:
        """Factors of this rank's entries' `values`; whether there are any: what is inside a half
        may want pivots of the border's. Raises NotConverged.
        """
        taken = self._exchanged(values[self._abroad])
        self._check(self.mumps.factorise(np.concatenate([values[~self._abroad], taken])))
        if self._comm.allreduce(self.mumps.replaced, op=MPI.SUM):
            return False
        stiffness = np.empty_like(self.mumps.added)
        self._comm.Allreduce(self.mumps.added, stiffness, op=MPI.SUM)
        *self._border, singular = sgetrf(stiffness.T, overwrite_a=True)
        if singular:
            raise NotConverged("the linear solver fails (the halves' border is singular)")
        return True

    def solve(self, load: Singles) -> Singles:
        """Solution for this rank's part of a `load`. Raises NotConverged."""
        half, message = np.zeros(self._size, dtype=np.float32), self._message(1)
        half[: load.size] = load
        message[-1] = self.mumps.condense(half, message[:-1])
        return self._expanded(message, 1)[0]

    def solve_many(self, loads: SparseColumns) -> Singles:
        """Solutions (k, n) of this rank's unknowns. Raises NotConverged."""
        count, own = len(loads.first) - 1, self._own
        here = (own.start <= loads.rows) & (loads.rows < own.stop)
        first = np.append(0, np.cumsum(here))[loads.first].astype(np.int32)
        rows, values = loads.rows[here] - np.int32(own.start), loads.values[here]
        if not here.any():  # MUMPS wants an entry at least
            first[1:], rows, values = 1, np.zeros(1, dtype=np.int32), np.zeros(1)
        message = self._message(count)
        singles = values.astype(np.float32)
        message[-1] = self.mumps.condense_many(first, rows, singles, message[:-1])
        return self._expanded(message, count)

    def end(self) -> None:
        """Give the memory back."""
        self.mumps.end()

    def _message(self, count: int) -> Singles:
        """Room for what of so many loads comes to the border, one after the other, and an error."""
        return np.zeros(count * self._n_border + 1, dtype=np.float32)

    def _expanded(self, message: Singles, count: int) -> Singles:
        """Solutions (k, n) of this rank's unknowns for loads of which this is its `message`."""
        self._comm.Allreduce(MPI.IN_PLACE, message, op=MPI.SUM)
        check(int(message[-1]))
        factors, pivots = self._border
        condensed = message[:-1].reshape(count, self._n_border)
        found, _ = sgetrs(factors, pivots, condensed.T, trans=1)
        half = np.empty((count, self._size), dtype=np.float32)
        if error := self.mumps.expand(found.T, half):
            raise MemoryError(f"the linear solver fails on one rank (MUMPS's error {error})")
        return half[:, : self._own.stop - self._own.start]

    def _exchanged(self, sent: Any) -> Any:
        """What the other rank has for this one."""
        other = 1 - self._comm.rank
        return self._comm.sendrecv(sent, other, source=other)

    def _check(self, error: int) -> None:
        check(self._comm.allreduce(error, op=MPI.MIN))


def separator(matrix: SpreadMatrix) -> Places:
    """The fewest unknowns of a `matrix` on two ranks, all of their nodes, without which its halves
    are apart: global numbers, increasing. Collective.

    Entries between ranks are a bipartite graph of nodes, whose least cover has the size of its
    largest matching (D. König, Mat. Fiz. Lapok 38 (1931) 116).
    """
    start, stop = matrix.starts[matrix.comm.rank :][:2]
    across = (matrix.columns < start) | (matrix.columns >= stop)
    pairs = np.stack([matrix.rows[across], matrix.columns[across]]) // matrix.components
    pairs.sort(axis=0)  # those of rank 0 first
    first, second = np.concatenate(matrix.comm.allgather(pairs), axis=1)
    shape = tuple(matrix.starts[1:] // matrix.components)
    graph = csr_matrix((np.ones(first.size, dtype=np.int32), (first, second)), shape=shape)
    partner = maximum_bipartite_matching(graph, perm_type="column")
    matched = np.flatnonzero(partner >= 0)
    partner_across = np.full(shape[1], -1, dtype=np.int32)
    partner_across[partner[matched]] = matched
    # what paths reach that begin without a partner, and go on with every second edge in a pair
    coupled = np.bincount(first, minlength=shape[0]) > 0
    reached, reached_across = coupled & (partner < 0), np.zeros(shape[1], dtype=bool)
    while True:
        found = (graph.T @ reached.astype(np.int32) > 0) & ~reached_across
        if not found.any():
            break
        reached_across |= found
        reached[partner_across[found]] = True
    cover = np.flatnonzero(coupled & ~reached), np.flatnonzero(reached_across)
    nodes = np.sort(np.concatenate(cover))
    unknowns = matrix.components * nodes[:, None] + np.arange(matrix.components)
    return unknowns.ravel().astype(np.int32)


def _order(
    matrix: SpreadMatrix, rows: Places, columns: Places, border: Places, size: int
) -> Places:
    """The order of elimination of a half's unknowns, from 1, by its entries: nested dissection of
    what is inside (MUMPS has no good one where unknowns are left), then the `border` as it is.
    """
    components, inside = matrix.components, np.ones(size, dtype=bool)
    inside[border] = False
    nodes = np.flatnonzero(inside[: len(matrix.points) * components : components])
    number = np.full(size, -1, dtype=np.int32)  # by a node's first unknown
    number[components * nodes] = np.arange(nodes.size)
    first, second = number[rows], number[columns]
    nodal = (first >= 0) & (second >= 0)
    place = np.empty(nodes.size, dtype=np.int32)
    place[dissected(matrix.points[nodes], first[nodal], second[nodal])] = np.arange(nodes.size)
    order = np.empty(size, dtype=np.int32)
    order[inside] = (components * place[:, None] + np.arange(1, components + 1)).ravel()
    order[border] = np.arange(size - border.size + 1, size + 1)
    return order
