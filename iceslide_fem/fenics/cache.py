"""The cache of compiled forms, shared by processes."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import os
import platform
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import writing
from iceslide_fem.runtime.launch import rank

SEAL = ".sealed"  # suffix of the file that lists a compiled module's files and sizes
LOCK = "lock"


def cache_folder() -> Path:
    """`$ICESLIDE_CACHE`, or `iceslide/` under `$XDG_CACHE_HOME` (`~/.cache`).

    If it is not writable, a temporary folder is used, with one note to the user. Raises SceneError
    if another user owns it.
    """
    if folder := os.environ.get("ICESLIDE_CACHE"):
        return Path(folder)
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return _writable_cache(Path(base) / "iceslide")


@functools.cache
def _writable_cache(usual: Path) -> Path:
    with contextlib.suppress(OSError):
        usual.mkdir(parents=True, exist_ok=True)
        if os.access(usual, os.W_OK):
            return usual
    folder = Path(tempfile.gettempdir()) / f"iceslide-{os.getuid()}"
    with writing(folder):
        folder.mkdir(mode=0o700, exist_ok=True)
    if folder.is_symlink() or folder.stat().st_uid != os.getuid():  # code is loaded from it
        raise SceneError(f"{folder} belongs to another user: name a folder by ICESLIDE_CACHE")
    if rank() == 0:
        print(
            f"Note: {usual} cannot be written: compiled forms are kept in {folder} "
            "(ICESLIDE_CACHE names another place).",
            file=sys.stderr,
        )
    return folder


def processor() -> str:
    """A word that differs between processors with different instructions."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith(("flags", "Features")):
                return hashlib.sha256(line.encode()).hexdigest()[:8]
    return platform.machine()


@contextlib.contextmanager
def sole_compiler(folder: Path) -> Iterator[None]:
    """Lock `folder`, so that only this process compiles into it; remove incomplete modules.

    A killed process or a full disk leaves an incomplete module. FFCx takes its source for a sign
    that another process is compiling, and waits. Therefore a complete module gets a seal with the
    sizes of its files, and a module without a valid seal is removed. The system releases the lock
    when its holder ends. Raises OutputError if the folder is not writable.
    """
    import fcntl  # not on Windows, where nothing is compiled

    with writing(f"compiled forms to {folder} (ICESLIDE_CACHE is another place for them)"):
        folder.mkdir(parents=True, exist_ok=True)
        lock = open(folder / LOCK, "w")
    with lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for files in _modules(folder).values():
            if not _is_whole(files):
                for name in files:
                    (folder / name).unlink(missing_ok=True)
        yield
        for module, files in _modules(folder).items():
            if f"{module}{SEAL}" not in files:
                with contextlib.suppress(OSError), open(folder / f"{module}{SEAL}", "w") as seal:
                    json.dump({name: entry.stat().st_size for name, entry in files.items()}, seal)


def _modules(folder: Path) -> dict[str, dict[str, os.DirEntry[str]]]:
    """Files of every compiled module; its name is a file's name up to the first dot."""
    modules: dict[str, dict[str, os.DirEntry[str]]] = defaultdict(dict)
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name != LOCK and entry.is_file(follow_symlinks=False):
                modules[entry.name.partition(".")[0]][entry.name] = entry
    return modules


def _is_whole(files: dict[str, os.DirEntry[str]]) -> bool:
    """Whether the `files` of a module match its seal."""
    seal = next((entry for name, entry in files.items() if name.endswith(SEAL)), None)
    try:
        sealed = json.loads(Path(seal.path).read_bytes()) if seal is not None else {}
    except (OSError, ValueError):
        return False
    return bool(sealed) and all(
        name in files and files[name].stat().st_size == size for name, size in sealed.items()
    )
