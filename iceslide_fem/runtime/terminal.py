"""Standard output of commands: a closed, full or limited terminal does not stop a run."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import Any

STANDARD_STREAMS = (0, 1, 2)


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
