"""Progress of a run: a bar in a terminal, else a line every few seconds, on rank 0 only."""

from __future__ import annotations

import sys
from time import monotonic
from types import TracebackType
from typing import Any, Self

from tqdm import tqdm

from iceslide_fem.run.observers import Observation

SECONDS_BETWEEN_LINES = 5.0


class Progress:
    """Context manager that shows how far a run of `total_time` (s, simulated) has come.

    On other ranks than 0 it shows nothing. Under mpirun standard error is no terminal, so there
    the lines are shown.
    """

    def __init__(self, comm_rank: int, total_time: float) -> None:
        self.total_time = total_time
        self._first = 0.0  # time (s) at which this part of the run began
        self._shown = comm_rank == 0
        self._bar: Any = None
        self._start = self._last_line = monotonic()

    def __enter__(self) -> Self:
        self._start = self._last_line = monotonic()
        if self._shown and sys.stderr.isatty():
            layout = (
                "{percentage:3.0f}% |{bar}| {n:.2f} of {total:.2f} ms{postfix} [{remaining} left]"
            )
            self._bar = tqdm(total=1e3 * self.total_time, bar_format=layout)
        return self

    def go_on(self, time: float) -> None:
        """Begin at `time` (s), which an earlier part of the run has reached."""
        self._first, self._start = time, monotonic()

    def __call__(self, step: Observation) -> None:
        """Show t = 0 or an accepted step of a slide."""
        row = step.row
        self.update(row.time_s, row.mu, row.step_s, row.newton_iterations, "sliding")

    def update(self, time: float, mu: float, step: float, newton: int, text: str = "") -> None:
        """Show an accepted step: its end `time` and length `step` (s), friction coefficient `mu`,
        number of `newton` iterations, and `text` such as the name of the phase.
        """
        if not self._shown:
            return
        words = [f"mu {mu:.3f}", f"step {1e3 * step:.3g} ms", f"{newton} Newton", text]
        if self._bar is not None:
            self._bar.set_postfix_str(", ".join(filter(None, words)), refresh=False)
            self._bar.update(1e3 * time - self._bar.n)
        elif monotonic() - self._last_line >= SECONDS_BETWEEN_LINES:
            self._last_line = monotonic()
            where = f"t = {1e3 * time:.3f} of {1e3 * self.total_time:g} ms"
            line = ", ".join(filter(None, [where, *words, self._time_left(time)]))
            print(line, file=sys.stderr, flush=True)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        # A bar left open at exit has ended a parallel run in an abort elsewhere.
        if self._bar is not None:
            self._bar.close()

    def _time_left(self, time: float) -> str:
        if time <= self._first:
            return ""
        share = (self.total_time - time) / (time - self._first)
        seconds = (monotonic() - self._start) * share
        return f"{seconds:.0f} s left"
