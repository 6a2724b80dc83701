"""Factors of a matrix that all ranks work on together."""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.fenics.mumps import Mumps, Singles, SparseColumns, SpreadMatrix, check


class SharedFactors:
    """MUMPS's, which shares its fronts out among the ranks. All methods are collective.

    Loads and solutions pass through the first rank, which MUMPS wants to have all of them.
    """

    def __init__(self, module: Any, matrix: SpreadMatrix) -> None:
        """Orders the unknowns of `matrix` by the compiled `module`."""
        self._comm = matrix.comm
        self._counts = np.diff(matrix.starts).tolist()  # of unknowns on each rank
        unknowns = sum(self._counts)
        self._unknowns_here = unknowns if self._comm.rank == 0 else 0
        self.mumps = Mumps(module, self._comm)
        check(self.mumps.analyse(unknowns, matrix.rows, matrix.columns))

    def factorise(self, values: Singles) -> bool:
        """Factors of this rank's entries' `values`. Raises NotConverged."""
        check(self.mumps.factorise(values))
        return True

    def solve(self, load: Singles) -> Singles:
        """Solution for this rank's part of a `load`. Raises NotConverged."""
        whole = self._gathered(load)
        check(self.mumps.solve(whole))
        return self._scattered(whole)

    def solve_many(self, loads: SparseColumns) -> Singles:
        """Solutions (k, n) of this rank's unknowns. Raises NotConverged."""
        whole = np.zeros((len(loads.first) - 1, self._unknowns_here), dtype=np.float32)
        check(self.mumps.solve_many(*loads[:2], loads.values.astype(np.float32), whole))
        return np.array([self._scattered(one) for one in whole])

    def end(self) -> None:
        """Give the memory back."""
        self.mumps.end()

    def _gathered(self, own: Singles) -> Singles:
        if self._comm.size == 1:
            return own
        whole = np.empty(self._unknowns_here, dtype=np.float32)
        self._comm.Gatherv(own, [whole, self._counts])
        return whole

    def _scattered(self, whole: Singles) -> Singles:
        if self._comm.size == 1:
            return whole
        own = np.empty(self._counts[self._comm.rank], dtype=np.float32)
        self._comm.Scatterv([whole, self._counts], own)
        return own
