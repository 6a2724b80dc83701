"""Checkpoint files of ranks other than the first, each with the rank's arrays.

Files are named by their content, and the checkpoint lists them. A new file therefore never replaces
a file of an older, still valid checkpoint.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import replace_file

PATTERN = "checkpoint.*"


class Part(NamedTuple):
    """The arrays of one rank in the file `path` with the SHA-256 `digest`."""

    path: Path
    digest: str

    def table(self, *names: str) -> dict[str, Array]:
        """The arrays of the table at this path of nested `names`. Raises ValueError."""
        begin = ".".join((*names, ""))
        with np.load(self.path, allow_pickle=False) as file:
            arrays = {key.removeprefix(begin): file[key] for key in file if key.startswith(begin)}
        for key, values in arrays.items():
            if not np.isfinite(values).all():
                raise ValueError(f"{begin}{key} is not finite")
        return arrays

    def check(self) -> None:
        """Raise SceneError unless the file exists with the saved content."""
        try:
            with open(self.path, "rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise SceneError(
                f"cannot read {self.path}, a part of the checkpoint: {error.strerror}"
            ) from None
        if digest != self.digest:
            raise SceneError(
                f"{self.path}, a part of the checkpoint, is damaged: its checksum does not fit"
            )


def packed(arrays: Mapping[str, Array]) -> bytes:
    """Arrays as the content of NumPy's `.npz`."""
    content = io.BytesIO()
    np.savez(content, **arrays)  # type: ignore[arg-type]
    return content.getvalue()


def write_part(folder: Path, rank: int, arrays: Mapping[str, Array]) -> tuple[str, str]:
    """Write the arrays of a rank; name and digest of the file. Raises OutputError."""
    content = packed(arrays)
    digest = hashlib.sha256(content).hexdigest()
    name = f"checkpoint.{rank}.{digest[:16]}"
    replace_file(folder / name, content)
    return name, digest


def parts_of(folder: Path, listed: Iterable[tuple[str, str]]) -> tuple[Part, ...]:
    """The parts listed in a checkpoint of `folder`. Raises SceneError if one is damaged."""
    parts = tuple(Part(folder / Path(name).name, digest) for name, digest in listed)
    for part in parts:
        part.check()
    return parts


def remove_others(folder: Path, listed: Iterable[tuple[str, str]]) -> None:
    """Remove parts that no checkpoint lists. Call it on one rank."""
    names: set[Any] = {name for name, _ in listed}
    for path in folder.glob(PATTERN):
        if path.name not in names and not path.name.endswith(".part"):
            path.unlink(missing_ok=True)
