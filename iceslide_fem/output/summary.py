"""The folder of a run, and its summary as JSON."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pydantic_core import to_json

from iceslide_fem.runtime.errors import OutputError
from iceslide_fem.runtime.files import replace_file, writing


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


_STOPPED = "stopped.txt"


def write_summary(path: Path | str, summary: Mapping[str, Any]) -> None:
    """Write `summary` as JSON; NaN and infinity become null. Call it on one rank.

    It gets a checksum of its entries and of the history.
    """
    text = to_json(summary, inf_nan_mode="null", fallback=lambda array: array.tolist())
    plain, path = json.loads(text), Path(path)
    plain["checksum"] = _checksum(path.parent, plain)
    replace_file(path, to_json(plain, indent=2) + b"\n")


def untouched(folder: Path, summary: Mapping[str, Any]) -> bool:
    """Whether `summary` and the history in `folder` are unchanged since the run."""
    entries = {key: value for key, value in summary.items() if key != "checksum"}
    return summary.get("checksum") == _checksum(folder, entries)


def notify_next_run(out: Path, error: Exception) -> None:
    """Save the reason why the run in `out` stopped."""
    with contextlib.suppress(OutputError):  # it may be the reason
        replace_file(out / _STOPPED, f"{str(error) or type(error).__name__}\n")


def word_of(out: Path) -> str:
    """The text that `notify_next_run` saved in `out`, or ""."""
    try:
        return (out / _STOPPED).read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def _checksum(folder: Path, entries: Mapping[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps(entries, sort_keys=True).encode())
    with contextlib.suppress(FileNotFoundError):
        digest.update((folder / "history.csv").read_bytes())
    return digest.hexdigest()
