"""Search of unknowns by position, over all ranks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.heat.elements import rows_of
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.runtime.arrays import Array, Index

Answer = TypeVar("Answer")


def answered(
    points: Array, wanted: Sequence[Index], here: Callable[[Array], Answer], comm: MPI.Comm
) -> Iterator[tuple[Index, Answer]]:
    """For each rank: numbers of this rank's `points` (n, d) sent to it, and its result of `here`.

    wanted: numbers of the points to send to each rank. Collective, when iteration starts.
    """
    questions = comm.alltoall([points[index] for index in wanted])
    answers = comm.alltoall([here(places) for places in questions])
    return zip(wanted, answers, strict=True)


SAME_PLACE = 1e-7  # of the body's extent


def numbers_at(equation: HeatEquation, points: Array) -> NDArray[np.int64]:
    """Global numbers of the unknowns at this rank's `points` (n, d), m; -1 if none. Collective."""
    comm, x = equation.comm, equation.x
    ends = x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)
    boxes = np.array(comm.allgather(ends))
    some = boxes[np.isfinite(boxes).all(axis=(1, 2))]
    near = SAME_PLACE * float(np.ptp(some, axis=(0, 1)).max())
    inside = (boxes[:, 0] - near <= points[:, None]) & (points[:, None] <= boxes[:, 1] + near)
    wanted = [np.flatnonzero(inside[:, rank].all(axis=1)) for rank in range(comm.size)]
    first = equation.conduction.getOwnershipRange()[0]

    def here(places: Array) -> NDArray[np.int64]:
        if not len(places) or not len(x):
            return np.full(len(places), -1, dtype=np.int64)
        distance, number = cKDTree(x).query(places)
        return np.where(distance <= near, first + number, -1)

    numbers = np.full(len(points), -1, dtype=np.int64)
    for index, answer in answered(points, wanted, here, comm):
        numbers[index] = np.maximum(numbers[index], answer)
    return numbers


def taking(equation: HeatEquation, numbers: NDArray[np.int64]) -> PETSc.Mat:
    """Matrix that copies the values of unknowns `numbers` (n_own,) to this rank's unknowns.

    The number -1 gives 0. Collective.
    """
    there = (numbers >= 0).astype(float)
    return rows_of(numbers[:, None], there[:, None], numbers.size, equation.comm)
