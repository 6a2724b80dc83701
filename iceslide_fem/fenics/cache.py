"""Where generated meshes and compiled forms are kept, and how processes share them."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import struct
import sys
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
    """Be the only process that compiles forms into `folder`, clearing what is unfinished or cut.

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
        there = set(os.listdir(folder))
        for source in there:
            if source.endswith(".c") and f"{source}.cached" not in there:
                (folder / source).unlink(missing_ok=True)
        _clear_cut_libraries(folder)
        yield


@functools.cache  # once in a process: they do not change any more
def _clear_cut_libraries(folder: Path) -> None:
    """Forget forms whose library is not whole (a full disk, a crash): no run could load them."""
    for library in folder.glob("*.so"):
        if not _is_whole(library):
            for part in folder.glob(f"{library.name.split('.')[0]}.*"):
                part.unlink(missing_ok=True)


def _is_whole(library: Path) -> bool:
    """Whether an ELF file (64 bits, little-endian) reaches to the end of its section headers."""
    with open(library, "rb") as file:
        header = file.read(64)
    if not header.startswith(b"\x7fELF\x02\x01") or len(header) < 64:
        return sys.platform != "linux" and len(header) == 64
    (offset,) = struct.unpack_from("<Q", header, 0x28)
    size, count = struct.unpack_from("<HH", header, 0x3A)
    return library.stat().st_size >= offset + size * count
