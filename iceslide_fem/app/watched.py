"""A command that stops when the process that started it ends.

`python -m iceslide_fem.app.watched run SCENE.toml ...`: standard input is a pipe without data. It
closes when the other process ends in any way. The command then sends itself SIGTERM, and the run
keeps its accepted steps.
"""

from __future__ import annotations

import os
import runpy
import signal
import threading


def _watch() -> None:
    while os.read(0, 1):  # not sys.stdin: a thread waiting in it aborts at exit
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    threading.Thread(target=_watch, daemon=True).start()
    runpy.run_module("iceslide_fem.cli", run_name="__main__")  # by name: it imports this folder
