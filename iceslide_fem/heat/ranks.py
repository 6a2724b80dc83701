"""What ranks ask each other about points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.runtime.arrays import Array, Index

Answer = TypeVar("Answer")


def answered(
    points: Array, wanted: Sequence[Index], here: Callable[[Array], Answer], comm: MPI.Comm
) -> Iterator[tuple[Index, Answer]]:
    """Which of this rank's `points` (n, d) each rank was asked for, and what is `here` there.

    wanted: numbers of the points, for every rank. Collective, before the first is given.
    """
    questions = comm.alltoall([points[index] for index in wanted])
    answers = comm.alltoall([here(places) for places in questions])
    return zip(wanted, answers, strict=True)
