"""A worker of a sweep: a process, or several under mpirun, that runs one case after the other.

It reads a line for each case on standard input, JSON of the arguments of `run_case`, and answers
each with a line: the exit code. It ends with its input. The start of DOLFINx and the imports are
paid once; a case is that of `iceslide run`.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from iceslide_fem.commands.outcome import exit_code
from iceslide_fem.commands.run import run
from iceslide_fem.runtime.launch import rank, started_by_mpirun


def _requests() -> Iterator[list[Any]]:
    """The requests on standard input of the first rank, on all ranks."""
    if not started_by_mpirun():
        yield from map(json.loads, sys.stdin)
        return
    from iceslide_fem.fenics.start import start_mpi

    comm = start_mpi().COMM_WORLD
    while line := comm.bcast(sys.stdin.readline() if comm.rank == 0 else None):
        yield json.loads(line)


@contextmanager
def _output_to(path: str) -> Iterator[None]:
    """Append standard output and error, also those of compiled code, to a file."""
    kept = [os.dup(number) for number in (1, 2)]
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    try:
        for number in (1, 2):
            os.dup2(file, number)
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, before in zip((1, 2), kept, strict=True):
            os.dup2(before, number)
            os.close(before)
        os.close(file)


def run_case(scene_file: str, folder: str, restart: bool, log: str) -> int:
    """Run or continue the case of a scene file in `folder`; output to the file `log`. Collective.

    Returns the exit code.
    """
    place = {"restart": Path(folder)} if restart else {"out": Path(folder), "force": True}
    with _output_to(log):
        # thousands of pages would be gigabytes
        return exit_code(partial(run, Path(scene_file), no_report=True, **place))


def main() -> None:
    """Answer requests until there are no more. Collective."""
    for request in _requests():
        code = run_case(*request)
        if rank() == 0:
            print(code, flush=True)


if __name__ == "__main__":
    main()
