"""What a command prints to: a screen that is gone, full or speaks another alphabet ends no run."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import Any

STANDARD_STREAMS = (0, 1, 2)


class _Patient:
    """A text stream that keeps silent after its first fault, which stays in `fault`."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.fault: OSError | None = None
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a letter that the terminal does not know

    def write(self, text: str) -> int:
        """Write `text`, or nothing if that is no longer possible."""
        self._try(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Pass on what has been written."""
        self._try(self._stream.flush)

    def _try(self, act: Callable[[], object]) -> None:
        if self.fault is not None:
            return
        try:
            act()
        except OSError as fault:
            self.fault = fault
            # What is still held goes nowhere, also when the interpreter ends.
            with open(os.devnull, "w") as nowhere, contextlib.suppress(OSError):
                os.dup2(nowhere.fileno(), self._stream.fileno())

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def patient_screen() -> Iterator[list[OSError]]:
    """Standard output and error that outlast their reader; the faults that came, as they come.

    A reader that has gone (`| head`) is none.
    """
    for number in STANDARD_STREAMS:  # or a file of the run would take a closed one's number
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
    """Print what a command found: a line of a table for each name and its value."""
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    for name, value in figures:
        table.add_row(name, value)
    Console().print(table)


def show_notes(warnings: Iterable[str]) -> None:
    """Print what a user should know of a result that stands."""
    for warning in warnings:
        print(f"Note: {warning}.")
