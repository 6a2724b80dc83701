"""How a command was started: its rank, known before MPI is imported, and signals that end it."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import sys
from collections.abc import Callable, Iterator
from typing import Any, NoReturn


@contextlib.contextmanager
def termination_as_interrupt() -> Iterator[None]:
    """SIGTERM (a queue's time limit) as KeyboardInterrupt, so that what is running is ended."""

    def interrupt(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def started_by_mpirun() -> bool:
    """Whether mpirun has started this process, alone or with others."""
    return any(name in os.environ for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE"))


def rank() -> int:
    """This process's rank, from what mpirun (Open MPI, MPICH) sets; without importing MPI."""
    for variable in ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"):
        if variable in os.environ:
            return int(os.environ[variable])
    return 0


def stop_other_ranks(exit_code: int) -> None:
    """End all ranks if this one fails alone: the others would wait for it forever."""
    if "mpi4py.MPI" in sys.modules:
        from mpi4py import MPI

        if MPI.COMM_WORLD.size > 1:
            MPI.COMM_WORLD.Abort(exit_code)


def on_one_process(command: Callable[..., None]) -> Callable[..., None]:
    """The command for rank 0; the others have nothing to do."""

    @functools.wraps(command)
    def alone(*args: Any, **options: Any) -> None:
        if rank() == 0:
            command(*args, **options)

    return alone
