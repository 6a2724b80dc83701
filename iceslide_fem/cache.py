"""Where generated meshes and compiled forms are kept, and how processes share them."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def cache_folder() -> Path:
    """`$ICESLIDE_CACHE`, or `iceslide/` under `$XDG_CACHE_HOME` (`~/.cache`)."""
    if folder := os.environ.get("ICESLIDE_CACHE"):
        return Path(folder)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "iceslide"


@contextmanager
def sole_compiler(folder: Path) -> Iterator[None]:
    """Be the only process that compiles forms into `folder`, after clearing what is unfinished.

    FFCx waits ten seconds for a form that another process compiles, and gives up: for ever, if
    that process was killed, because its source stays behind without a library. The lock waits
    as long as it takes, and the system releases it when its holder dies.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for source in folder.glob("*.c"):
            if not source.with_suffix(".c.cached").exists():
                source.unlink(missing_ok=True)
        yield
