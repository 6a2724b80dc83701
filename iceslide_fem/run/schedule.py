"""When a run writes checkpoints and fields."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from iceslide_fem.fenics.compat import MPI

FIELD_TIMES = 25


class Schedule(NamedTuple):
    """When checkpoints are written: every so many seconds of the clock, and after these times of
    the run (s)."""

    every: float = 60.0
    times: tuple[float, ...] = ()


class Saves:
    """Says after which steps a checkpoint is due."""

    def __init__(self, schedule: Schedule, time: float, comm: MPI.Comm) -> None:
        self._every, self._comm, self._last = schedule.every, comm, monotonic()
        self._times = sorted(at for at in schedule.times if at > time)

    def __call__(self, time: float) -> bool:
        """Whether one is due at `time` (s). Collective: rank 0's clock decides."""
        passed = [at for at in self._times if at <= time]
        self._times = self._times[len(passed) :]
        late = self._comm.bcast(monotonic() - self._last >= self._every)
        if passed or late:
            self._last = monotonic()
        return bool(passed) or late


class FieldTimes:
    """Says after which steps fields are written: the first one in each of `FIELD_TIMES` parts."""

    def __init__(self, duration: float, time: float) -> None:
        """`time` (s) is that of the last step done."""
        self._duration = duration
        self._part = self._part_of(time)

    def __call__(self, time: float) -> bool:
        """Whether fields are due at `time` (s)."""
        before, self._part = self._part, self._part_of(time)
        return self._part > before

    def _part_of(self, time: float) -> int:
        return int(FIELD_TIMES * time / self._duration)
