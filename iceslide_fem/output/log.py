"""The log of a run: events as lines of JSON."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pydantic_core import to_json

from iceslide_fem.runtime.files import writing


class Log:
    """`log.jsonl` in a run's folder, on rank 0 only. Lines are written completely."""

    def __init__(self, folder: Path, rank: int) -> None:
        """Append to existing lines."""
        self._path, self._rank = folder / "log.jsonl", rank

    def __call__(self, event: str, **facts: Any) -> None:
        """Log an `event` with its `facts`. Raises OutputError."""
        if self._rank > 0:
            return
        clock = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = to_json({"clock": clock, "event": event, **facts}, inf_nan_mode="null")
        with writing(self._path), open(self._path, "ab") as file:
            file.write(line + b"\n")
