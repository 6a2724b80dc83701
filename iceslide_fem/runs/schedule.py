"""Times at which a run writes checkpoints and fields."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from iceslide_fem.fenics.compat import MPI

import signal
from types import FrameType, TracebackType
from typing import Any, Self

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.runtime.errors import Interrupted
from iceslide_fem.runtime.launch import stop_signals

_ASKED = 1000  # a request that is no signal


class Interruption:
    """Context manager that records requests to stop; a second SIGINT (Ctrl-C) ends the process."""

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm = comm
        self._heard = 0  # signal on this rank; written by the handler only
        self._agreed = 0  # signal known to all ranks
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        self._before = {number: signal.signal(number, self._note) for number in stop_signals()}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def ask(self) -> None:
        """Ask the run to stop, on this rank."""
        self._heard = self._heard or _ASKED

    def requested(self) -> bool:
        """Whether any rank has been asked to stop. Collective."""
        self._agreed = max(self._agreed, self._comm.allreduce(self._heard, op=MPI.MAX))
        return self._agreed > 0

    def error(self, where: str, folder: object) -> Interrupted:
        """The error to raise, with who asked, `where`, and how to continue."""
        asked = self._agreed == _ASKED
        who = "the caller's progress function" if asked else signal.Signals(self._agreed).name
        return Interrupted(
            f"stopped by {who} {where}; iceslide run --restart {folder} goes on from here"
        )

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._heard = number
        if number == signal.SIGINT:  # queues repeat the others
            signal.signal(number, signal.SIG_DFL)


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
