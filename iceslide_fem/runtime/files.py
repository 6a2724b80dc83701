"""Files: checks of readable files, atomic writing, and error messages."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

from iceslide_fem.runtime.errors import OutputError, SceneError


def is_regular(path: Path) -> bool:
    """Whether `path` is an accessible regular file."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or a folder without permission
        return False


def check_regular(path: Path, what: str) -> None:
    """Raise SceneError if `path` is not a regular file; what: its name in the message."""
    try:
        special = path.exists() and not path.is_file()
    except (OSError, ValueError) as error:  # an invalid file name
        raise SceneError(
            f"cannot read {what} {path}: {getattr(error, 'strerror', error)}"
        ) from None
    if special:
        raise SceneError(f"cannot read {what} {path}: it is not a regular file")


def check_writable(out: Path) -> None:
    """Raise SceneError if `out` is not, or cannot become, a writable directory."""
    try:
        existing = next(path for path in (out, *out.absolute().parents) if path.exists())
    except (OSError, ValueError) as error:  # a name too long, or with a null character
        raise SceneError(f"cannot write to {out}: {getattr(error, 'strerror', error)}") from None
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        raise SceneError(f"cannot write to {out}: {existing} is not a directory one may write to")


@contextlib.contextmanager
def writing(path: Path | str) -> Iterator[None]:
    """Turn an OSError into an OutputError that names `path`."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Temporary file that replaces `path` when all is written.

    Raises OutputError (for example, the disk is full); the old file then stays, and the temporary
    file is removed.
    """
    temporary = path.with_name(path.name + ".part")
    with writing(path):
        try:
            yield temporary
            os.replace(temporary, path)
        except OSError:
            temporary.unlink(missing_ok=True)
            raise


def replace_file(path: Path, content: str | bytes) -> None:
    """Write the file atomically: even after a loss of power the old or the new one is complete.

    Raises OutputError, as `replacing`.
    """
    data = content.encode() if isinstance(content, str) else content
    with replacing(path) as temporary, open(temporary, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def replace_end(path: Path, at: int, content: bytes) -> None:
    """Replace the end of the file from byte `at` on by `content`, in one write.

    Raises OutputError; the file is then unchanged.
    """
    with writing(path), open(path, "r+b", buffering=0) as file:
        file.seek(at)
        before = file.read()
        try:
            file.seek(at)
            if file.write(content) < len(content):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            file.truncate(at + len(before))
            file.seek(at)
            file.write(before)
            raise
