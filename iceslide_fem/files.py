"""Files that are whole at any moment: written beside their place and then renamed into it."""

from __future__ import annotations

import os
from pathlib import Path


def replace_file(path: Path, content: str | bytes) -> None:
    """Write the file so that at any time, also after a crash, the old or the new one is complete.

    Raises OSError (the disk is full, say); the old file then stays and nothing is left beside it.
    """
    temporary = path.with_name(path.name + ".part")
    data = content.encode() if isinstance(content, str) else content
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
