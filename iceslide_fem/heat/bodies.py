"""Bodies that conduct heat together with the films between them: one system of unknowns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.surface import Reading


class Bodies:
    """The unknowns of some heat equations, on each rank those of one after those of the other.

    capacity, drawn, held: as `HeatEquation` has them, (n_own,); conduction: the joint matrix.
    """

    def __init__(self, equations: Sequence[HeatEquation]) -> None:
        """Bodies without contact yet. Collective."""
        self.equations, self.comm = tuple(equations), equations[0].comm
        self.capacity = np.concatenate([one.capacity for one in equations])
        self.drawn = np.concatenate([one.drawn for one in equations])
        self.held: Mask = np.concatenate([one.held for one in equations])
        self._ends = np.cumsum([one.capacity.size for one in equations])
        self.conduction = equations[0].conduction
        if len(equations) > 1:
            blocks = [
                [one.conduction if i == j else None for j in range(len(equations))]
                for i, one in enumerate(equations)
            ]
            nested = PETSc.Mat().createNest(blocks, comm=self.comm)
            self.conduction = nested.convert("aij")
        self._own_ranges = [one.conduction.getOwnershipRanges() for one in equations]

    def initial(self) -> Array:
        """Rise at t = 0, K, (n_own,)."""
        return np.concatenate([one.initial() for one in self.equations])

    def parts(self, values: Array) -> list[Array]:
        """Values (n_own,) of each body."""
        return np.split(values, self._ends[:-1])

    def total(self, own: float) -> float:
        """Sum over all ranks. Collective."""
        return float(self.comm.allreduce(own, op=MPI.SUM))

    def joint(self, body: int, reading: Reading) -> Reading:
        """The `reading` of a body's unknowns by their numbers among those of all bodies."""
        if len(self.equations) == 1:
            return reading
        ranges = np.asarray(self._own_ranges[body])
        joint = np.sum(self._own_ranges, axis=0)  # where the ranks begin
        rank = np.searchsorted(ranges, reading.number, side="right") - 1
        before = sum(np.diff(other)[rank] for other in self._own_ranges[:body])
        return Reading(joint[rank] + before + reading.number - ranges[rank], reading.weight)
