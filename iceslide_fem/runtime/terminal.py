"""What commands show: output that survives a closed, full or limited terminal, and progress.

Progress of a long task is a bar in a terminal, one updated line in a notebook, else a line every
few seconds. Nothing is shown of a short task.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Self

STANDARD_STREAMS = (0, 1, 2)
SECONDS_BETWEEN_LINES = 5.0
SECONDS_UNTIL_BAR = 1.0
SECONDS_BETWEEN_REFRESHES = 0.2


class _Patient:
    """A text stream that discards output after its first error, stored in `fault`."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.fault: OSError | None = None
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # characters outside the terminal's encoding

    def write(self, text: str) -> int:
        """Write `text`, or discard it after an error."""
        self._try(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        self._try(self._stream.flush)

    def _try(self, act: Callable[[], object]) -> None:
        if self.fault is not None:
            return
        try:
            act()
        except OSError as fault:
            self.fault = fault
            # Discard buffered output, also at the interpreter's exit.
            with open(os.devnull, "w") as nowhere, contextlib.suppress(OSError):
                os.dup2(nowhere.fileno(), self._stream.fileno())

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def patient_screen() -> Iterator[list[OSError]]:
    """Make standard output and error survive a closed reader; yields the list of faults.

    A reader that has ended (`| head`) is not a fault.
    """
    for number in STANDARD_STREAMS:  # else a file of the run could get a closed descriptor
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    faults: list[OSError] = []
    streams = [_Patient(each or open(os.devnull, "w")) for each in (sys.stdout, sys.stderr)]
    with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
        yield faults
        streams[0].flush()
        fault = streams[0].fault
        if fault is not None and fault.errno != errno.EPIPE:
            faults.append(fault)


def show_figures(figures: Iterable[tuple[str, str]]) -> None:
    """Print results: one table line for each name and value."""
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    for name, value in figures:
        table.add_row(name, value)
    Console().print(table)


def show_notes(warnings: Iterable[str]) -> None:
    """Print notes on a valid result."""
    for warning in warnings:
        print(f"Note: {warning}.")


@contextlib.contextmanager
def without_progress() -> Iterator[None]:
    """Show no progress of this process within: neither long tasks nor what `say` is given."""
    before, LongTask.are_shown = LongTask.are_shown, False
    try:
        yield
    finally:
        LongTask.are_shown = before


def say(line: str) -> None:
    """Print a line about the progress of a command."""
    if LongTask.are_shown:
        print(line, flush=True)


class LongTask:
    """Context manager that shows progress towards `total`, on standard error."""

    are_shown = True  # see `without_progress`

    def __init__(self, total: float, shown: bool = True) -> None:
        self.total = total
        self._shown = shown and LongTask.are_shown
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
