"""Requests to stop: SIGTERM (a queue's limit) and SIGINT (Ctrl-C), handled between trial steps."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Any, Self

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.runtime.errors import Interrupted

_SIGNALS = (signal.SIGTERM, signal.SIGINT)


class Interruption:
    """Context manager that records the first of these signals; a second one ends the process."""

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm = comm
        self._heard = 0  # signal on this rank; written by the handler only
        self._agreed = 0  # signal known to all ranks
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        self._before = {number: signal.signal(number, self._note) for number in _SIGNALS}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def requested(self) -> bool:
        """Whether any rank has been asked to stop. Collective."""
        self._agreed = max(self._agreed, self._comm.allreduce(self._heard, op=MPI.MAX))
        return self._agreed > 0

    def error(self, where: str, folder: object) -> Interrupted:
        """The error to raise, with the signal, `where`, and how to continue."""
        return Interrupted(
            f"stopped by {signal.Signals(self._agreed).name} {where}; "
            f"iceslide run --restart {folder} goes on from here"
        )

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._heard = number
        for each in _SIGNALS:
            signal.signal(each, signal.SIG_DFL)
