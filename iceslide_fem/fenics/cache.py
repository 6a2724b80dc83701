"""Where generated meshes and compiled forms are kept, and how processes share them."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
from collections.abc import Iterator
from pathlib import Path

from iceslide_fem.files import writing


def cache_folder() -> Path:
    """`$ICESLIDE_CACHE`, or `iceslide/` under `$XDG_CACHE_HOME` (`~/.cache`)."""
    if folder := os.environ.get("ICESLIDE_CACHE"):
        return Path(folder)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "iceslide"


def processor() -> str:
    """A word that differs between processors with different instructions."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith(("flags", "Features")):
                return hashlib.sha256(line.encode()).hexdigest()[:8]
    return platform.machine()


@contextlib.contextmanager
def sole_compiler(folder: Path) -> Iterator[None]:
    """Be the only process that compiles forms into `folder`, after clearing what is unfinished.

    FFCx waits ten seconds for a form that another process compiles, and gives up: for ever, if
    that process was killed, because its source stays behind without a library. The lock waits
    as long as it takes, and the system releases it when its holder dies. Raises OutputError where
    nothing can be written.
    """
    import fcntl  # not on Windows, where nothing is compiled

    with writing(f"compiled forms to {folder} (ICESLIDE_CACHE is another place for them)"):
        folder.mkdir(parents=True, exist_ok=True)
        lock = open(folder / "lock", "w")
    with lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for source in folder.glob("*.c"):
            if not source.with_suffix(".c.cached").exists():
                source.unlink(missing_ok=True)
        yield
