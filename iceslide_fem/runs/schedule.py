"""Times at which a run writes checkpoints and fields."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from iceslide_fem.fenics.compat import MPI

ROUNDING = 1e-9


class Schedule(NamedTuple):
    """Schedule of checkpoints: an interval of the clock (s), and times of the run (s).

    The clock, also of `numerics.time_limit`, is the wall clock or, for example,
    `time.process_time`.
    """

    every: float = 60.0
    times: tuple[float, ...] = ()
    clock: Callable[[], float] = monotonic


class Saves:
    """Decides after which steps a checkpoint is written."""

    def __init__(self, schedule: Schedule, time: float, comm: MPI.Comm) -> None:
        self._every, self._clock, self._comm = schedule.every, schedule.clock, comm
        self._last = self._clock()
        self._times = sorted(at for at in schedule.times if at > time)

    def __call__(self, time: float) -> bool:
        """Whether to write one at `time` (s). Collective: rank 0's clock decides."""
        passed = [at for at in self._times if at <= time]
        self._times = self._times[len(passed) :]
        late = self._comm.bcast(self._clock() - self._last >= self._every)
        if passed or late:
            self._last = self._clock()
        return bool(passed) or late


class FieldTimes:
    """Decides after which steps fields are written: the first at or after each time."""

    def __init__(
        self, times: int | float | Sequence[float], duration: float, since: float | None
    ) -> None:
        """`times` as in `scene.Output`, of a run of `duration` (s).

        since: time of the last step, s, None before t = 0.
        """
        self._times, self._duration = times, duration
        self._passed = 0 if since is None else self._count(since)

    def __call__(self, time: float) -> bool:
        """Whether to write fields at `time` (s)."""
        before, self._passed = self._passed, self._count(time)
        return self._passed > before

    def _count(self, time: float) -> int:
        """Number of field times up to `time`."""
        if isinstance(self._times, int):
            return 1 + int(self._times * time / self._duration) if self._times else 0
        if isinstance(self._times, float):
            return 1 + int(time / self._times * (1.0 + ROUNDING))
        return bisect_right(self._times, time * (1.0 + ROUNDING))
