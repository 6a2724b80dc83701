"""What ranks do together: one does a task for all, and where one fails alone none waits for it."""

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

PATIENCE = 3.0  # s, how long a rank that failed waits for the others to fail as well
_Result = TypeVar("_Result")


def from_root(task: Callable[[], _Result], comm: Any) -> _Result:
    """Result of a task that only rank 0 runs, on every rank, after it has ended. Collective.

    What rank 0 raises is raised on every rank. `comm` None: there is one rank.
    """
    if comm is None or comm.size == 1:
        return task()
    result = together(lambda: task() if comm.rank == 0 else None, comm)
    return cast("_Result", comm.bcast(result))


def together(task: Callable[[], _Result], comm: Any) -> _Result:
    """Result of a task that every rank runs, or on all of them what the first one raises that does.

    Collective.
    """
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
    """Let an error pass that all ranks have; end all ranks where one has it alone.

    Others would wait for that one for ever, in whatever they do together. It says what it failed
    of, on its own standard error, and `note` is called with it; of an error that all have, rank
    0 calls `note`. Collective at its beginning.
    """
    others = comm.Dup()  # of its own, so that no other message can be taken for this question
    try:
        yield
    except Exception as error:
        alone = not _all_arrive(others)
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


def _all_arrive(comm: Any) -> bool:
    """Whether all ranks come here within PATIENCE."""
    request, end = comm.Ibarrier(), time.monotonic() + PATIENCE
    while not request.Test():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
