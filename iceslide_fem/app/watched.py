"""A command that asks itself to stop when the process that started it is gone.

`python -m iceslide_fem.app.watched run SCENE.toml ...`: standard input is a pipe that nobody writes
to. Its end comes when the other process ends, however it ends, and is then heard as SIGTERM, upon
which a run keeps what it has accepted.
"""

from __future__ import annotations

import os
import runpy
import signal
import threading


def _watch() -> None:
    while os.read(0, 1):  # not sys.stdin: a thread that waits in it ends in an abort at exit
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    threading.Thread(target=_watch, daemon=True).start()
    runpy.run_module("iceslide_fem.cli", run_name="__main__")  # by its name: it imports this folder
