"""Several heat-conducting bodies in one system of unknowns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.heat.elements import rows_of
from iceslide_fem.heat.equation import Conducting, HeatEquation
from iceslide_fem.heat.surface import Reading
from iceslide_fem.runtime.arrays import Array


class Bodies:
    """The unknowns of several heat equations, concatenated on each rank.

    capacity: of each, J/K, (n_own,); conduction: the joint matrix at the initial temperature.
    """

    def __init__(self, equations: Sequence[HeatEquation]) -> None:
        """Bodies without contact. Collective."""
        self.equations, self.comm = tuple(equations), equations[0].comm
        self.capacity = np.concatenate([one.capacity for one in equations])
        self._drawn = np.concatenate([one.drawn for one in equations])
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
        """Heat state at t = 0, K, (n_own,)."""
        return np.concatenate([one.initial() for one in self.equations])

    def rise(self, heat_state: Array) -> Array:
        """Rise (K) of a heat state."""
        return self._each("rise", heat_state)

    def heat_state(self, rise: Array) -> Array:
        """Heat state of a rise (K)."""
        return self._each("heat_state", rise)

    def steepness(self, rise: Array) -> Array:
        """Derivative of the heat state with the rise."""
        return self._each("steepness", rise)

    def conducting(self, rise: Array) -> Conducting:
        """Conduction at a rise; constant for several bodies. Collective."""
        if len(self.equations) == 1:
            return self.equations[0].conducting(rise)
        return Conducting(self.conduction, self._drawn)

    def _each(self, what: str, values: Array) -> Array:
        pairs = zip(self.equations, self.parts(values), strict=True)
        return np.concatenate([getattr(one, what)(part) for one, part in pairs])

    def parts(self, values: Array) -> list[Array]:
        """Values (n_own,) of each body."""
        return np.split(values, self._ends[:-1])

    def total(self, own: float) -> float:
        """Sum over all ranks. Collective."""
        return float(self.comm.allreduce(own, op=MPI.SUM))

    def joint(self, body: int, reading: Reading) -> Reading:
        """The `reading` of a body with its unknowns in joint numbers of all bodies."""
        if len(self.equations) == 1:
            return reading
        ranges = np.asarray(self._own_ranges[body])
        joint = np.sum(self._own_ranges, axis=0)  # first number of each rank
        rank = np.searchsorted(ranges, reading.number, side="right") - 1
        before = sum(np.diff(other)[rank] for other in self._own_ranges[:body])
        return Reading(joint[rank] + before + reading.number - ranges[rank], reading.weight)

    def reading(self, reading: Reading) -> PETSc.Mat:
        """Interpolation matrix from the unknowns of all bodies, in joint numbers. Collective."""
        return rows_of(reading.number, reading.weight, self.capacity.size, self.comm)
