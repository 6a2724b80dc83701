"""Progress of a long task: a bar in a terminal, one updated line in a notebook, else a line every
few seconds.

Nothing is shown of a short task.
"""

from __future__ import annotations

import sys
import time
from typing import Any, Self

SECONDS_BETWEEN_LINES = 5.0
SECONDS_UNTIL_BAR = 1.0
SECONDS_BETWEEN_REFRESHES = 0.2


class LongTask:
    """Context manager that shows progress towards `total`, on standard error."""

    def __init__(self, total: float, shown: bool = True) -> None:
        self.total = total
        self._shown = shown
        self._first = 0.0  # done before this part
        self._bar: Any = None
        self._cell: _Cell | None = None
        self._start = self._last = time.monotonic()

    def __enter__(self) -> Self:
        self._start = self._last = time.monotonic()
        return self

    def go_on(self, done: float) -> None:
        """Start at `done`, reached by an earlier part of the task."""
        self._first, self._start = done, time.monotonic()

    def show(self, done: float, where: str, *words: str) -> None:
        """Show the amount `done`, its description `where`, and other `words`."""
        now = time.monotonic()
        if not self._shown:
            return
        line = ", ".join(filter(None, [where, *words, self._time_left(done, now)]))
        if in_notebook():
            if now - self._last >= SECONDS_UNTIL_BAR:
                self._last = now
                self._cell = self._cell or _Cell()
                self._cell.show(line)
        elif not sys.stderr.isatty():
            if now - self._last >= SECONDS_BETWEEN_LINES:
                self._last = now
                print(line, file=sys.stderr, flush=True)
        elif now - self._start >= SECONDS_UNTIL_BAR and (
            self._bar is None or now - self._last >= SECONDS_BETWEEN_REFRESHES
        ):
            self._last = now
            self._draw(done, where, ", ".join(filter(None, words)), self._time_left(done, now))

    def _draw(self, done: float, where: str, words: str, left: str) -> None:
        if self._bar is None:
            self._bar = _bar(self.total)
            self._bar.start()
        (task,) = self._bar.task_ids
        self._bar.update(task, completed=done, where=where, words=words, left=left, refresh=True)

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        # A bar left open at exit can abort a parallel run.
        if self._bar is not None:
            self._bar.stop()
        if self._cell is not None and error is None:
            self._cell.show(f"done in {time.monotonic() - self._start:.0f} s")

    def _time_left(self, done: float, now: float) -> str:
        if done <= self._first:
            return ""
        share = (self.total - done) / (done - self._first)
        return f"{(now - self._start) * share:.0f} s left"


def in_notebook() -> bool:
    """Whether this is a notebook kernel, without importing IPython."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


class _Cell:
    """An output line of a notebook that the next one replaces."""

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, line: str) -> None:
        """Replace the line by `line`."""
        from IPython.display import display

        content = {"text/plain": line}
        if self._handle is None:
            self._handle = display(content, raw=True, display_id=True)
        else:
            self._handle.update(content, raw=True)


def _bar(total: float) -> Any:
    """A bar that shortens other words first in a narrow terminal, not the remaining time."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn
    from rich.table import Column

    bar = Progress(
        TextColumn("{task.percentage:3.0f}%", table_column=Column(no_wrap=True, min_width=4)),
        BarColumn(bar_width=None, table_column=Column(ratio=1, min_width=6)),
        TextColumn(
            "{task.fields[left]}",
            table_column=Column(no_wrap=True, min_width=len("99999 s left"), justify="right"),
        ),
        TextColumn(
            "{task.fields[where]}, {task.fields[words]}",
            table_column=Column(ratio=2, no_wrap=True, overflow="ellipsis"),
        ),
        console=Console(file=sys.stderr),
        auto_refresh=False,
        expand=True,
    )
    bar.add_task("", total=total, where="", words="", left="")
    return bar
