"""What a command ends with: its exit code, and the sentence of its error."""

from __future__ import annotations

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Callable

from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.runtime.launch import rank, stop_all_ranks


def exit_code(command: Callable[[], object]) -> int:
    """Run a `command`; returns its exit code (`cli.main`). Only rank 0 prints.

    A fault of the program on one rank ends all ranks.
    """
    with contextlib.ExitStack() as stack:
        if rank() > 0:
            silence = stack.enter_context(open(os.devnull, "w"))
            stack.enter_context(contextlib.redirect_stdout(silence))
            stack.enter_context(contextlib.redirect_stderr(silence))
        try:
            command()
        except SystemExit as end:  # typer's own: 0 done, 2 wrong usage
            return int(end.code or 0)
        except IceslideError as error:
            print(f"iceslide: {error}", file=sys.stderr)
            if rank() > 0:  # a failing rank makes mpirun end rank 0, perhaps before it prints
                time.sleep(1.0)
            return error.exit_code
        except Exception:
            traceback.print_exc(file=sys.__stderr__)  # also on ranks that do not print
            stop_all_ranks(1)
            return 1
    return 0
