"""Requests to stop: by a signal (`launch.STOPS`) or by the caller, handled between trial steps."""

from __future__ import annotations

import signal
from types import FrameType
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

    def __exit__(self, *_: object) -> None:
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
