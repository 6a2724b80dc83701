"""Queries of points between ranks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from iceslide_fem.fenics.compat import MPI
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
