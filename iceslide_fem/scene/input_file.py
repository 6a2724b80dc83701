"""Input files named by a user: only regular files of limited size are opened."""

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
    return path.absolute()  # valid in another working directory, where a run is continued


InputFile = Annotated[Path, AfterValidator(_regular)]  # like pydantic's FilePath, without OSError


def read_text(path: Path, what: str) -> str:
    """Text of the file at `path`, without a byte order mark; what: its name in messages.

    Raises SceneError if it is not a regular file, is larger than 10 MB or is not UTF-8.
    """
    check_regular(path, what)
    try:
        if (size := path.stat().st_size) > LARGEST_TEXT:
            reason = f"it has {size / 1e6:.0f} MB; allowed: up to {LARGEST_TEXT / 1e6:.0f} MB"
        else:
            return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError:  # not UTF-8, or an invalid file name
        reason = "it is not UTF-8 text"
    raise SceneError(f"cannot read {what} {path}: {reason}")
