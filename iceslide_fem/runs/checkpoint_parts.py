"""What ranks other than the first keep of a checkpoint: each a file of its own arrays beside it.

Files are named by their content, and the checkpoint lists them: one that is written while an older
checkpoint still counts never replaces what that one lists.
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
    """The arrays of one rank: in `path`, whose content has the SHA-256 `digest`."""

    path: Path
    digest: str

    def table(self, *names: str) -> dict[str, Array]:
        """The arrays of a table, which is in the tables with these names. Raises ValueError."""
        begin = ".".join((*names, ""))
        with np.load(self.path, allow_pickle=False) as file:
            arrays = {key.removeprefix(begin): file[key] for key in file if key.startswith(begin)}
        for key, values in arrays.items():
            if not np.isfinite(values).all():
                raise ValueError(f"{begin}{key} is not finite")
        return arrays

    def check(self) -> None:
        """Raise SceneError unless the file is there, as it was written."""
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
    """The parts that a checkpoint in `folder` lists. Raises SceneError if one is not whole."""
    parts = tuple(Part(folder / Path(name).name, digest) for name, digest in listed)
    for part in parts:
        part.check()
    return parts


def remove_others(folder: Path, listed: Iterable[tuple[str, str]]) -> None:
    """Remove parts that no checkpoint lists any more. Call it on one rank."""
    names: set[Any] = {name for name, _ in listed}
    for path in folder.glob(PATTERN):
        if path.name not in names and not path.name.endswith(".part"):
            path.unlink(missing_ok=True)
