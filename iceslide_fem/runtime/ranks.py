"""Tasks of ranks: one rank works for all, and a failure of one rank does not block the others."""

from __future__ import annotations

import contextlib
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast

from iceslide_fem.runtime import errors
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.runtime.launch import stop_all_ranks

PATIENCE = 3.0  # s, time that a failed rank waits for the others to fail, too
UNUSUAL = 10.0  # s, time after which a rank says that it waits for the others
_Result = TypeVar("_Result")


def from_root(task: Callable[[], _Result], comm: Any) -> _Result:
    """Result, on every rank, of a task that only rank 0 runs. Collective.

    An error on rank 0 is raised on every rank. `comm` None: one rank.
    """
    if comm is None or comm.size == 1:
        return task()
    result = together(lambda: task() if comm.rank == 0 else None, comm)
    return cast("_Result", comm.bcast(result))


def together(task: Callable[[], _Result], comm: Any) -> _Result:
    """Result of a task that every rank runs; all ranks raise the first rank's error. Collective."""
    fault: tuple[str, str] | None = None
    original: Exception | None = None
    try:
        result = task()
    except Exception as error:
        original, fault = error, (type(error).__name__, str(error))
    faults = [one for one in comm.allgather(fault) if one is not None]
    if original is not None:
        raise original
    if faults:
        kind, sentence = faults[0]
        raise getattr(errors, kind, RuntimeError)(sentence)
    return result


@contextlib.contextmanager
def failing_together(comm: Any, note: Callable[[Exception], None] | None = None) -> Iterator[None]:
    """Propagate an error that all ranks have; end all ranks if only one has it.

    The other ranks would wait for ever for the failed rank. It prints its error, and calls `note`
    with it. If all ranks fail, rank 0 calls `note`. Collective at its start.
    """
    others = comm.Dup()  # separate, so other messages cannot be mistaken for this one
    try:
        yield
    except Exception as error:
        alone = not _done(others.Ibarrier(), PATIENCE)
        if note is not None and (alone or comm.rank == 0):
            note(error)
        if alone:
            if isinstance(error, IceslideError):
                print(f"iceslide: {error}", file=sys.__stderr__, flush=True)
            else:
                traceback.print_exc(file=sys.__stderr__)
            stop_all_ranks(getattr(error, "exit_code", 1))
        others.Free()
        raise
    others.Free()


def arrive(comm: Any, waits: str) -> None:
    """Wait for the other ranks; print that this one `waits` if they do not come. Collective."""
    request = comm.Ibarrier()
    if not _done(request, UNUSUAL):
        print(f"Note: rank {comm.rank} waits for the others: {waits}", file=sys.__stderr__)
        request.Wait()


def _done(request: Any, within: float) -> bool:
    """Whether a request is fulfilled within this time (s)."""
    end = time.monotonic() + within
    while not request.Test():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
