"""Files that a person names: regular ones of a size that can be meant, nothing else is opened."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular, is_regular

LARGEST_TEXT = 10_000_000  # bytes


def _regular(path: Path) -> Path:
    if not is_regular(path):
        raise PydanticCustomError("path_not_file", "is not a file")
    return path


InputFile = Annotated[
    Path, AfterValidator(_regular)
]  # as pydantic's FilePath, but never an OSError


def read_text(path: Path, what: str) -> str:
    """Text of the file at `path`, of which messages speak as `what`; a byte order mark is skipped.

    Raises SceneError if it is no regular file (a device has no end), is larger than 10 MB or
    cannot be read as UTF-8.
    """
    check_regular(path, what)
    try:
        if (size := path.stat().st_size) > LARGEST_TEXT:
            reason = f"it has {size / 1e6:.0f} MB; allowed: up to {LARGEST_TEXT / 1e6:.0f} MB"
        else:
            return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError:  # no UTF-8, or a name that no file can have
        reason = "it is not UTF-8 text"
    raise SceneError(f"cannot read {what} {path}: {reason}")
