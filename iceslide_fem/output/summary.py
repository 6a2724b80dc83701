"""The folder of a run, and its summary as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic_core import to_json

from iceslide_fem.files import replace_file, writing


def begin_run(out: Path, rank: int) -> None:
    """Make the directory of a run; the summary of an earlier one there goes."""
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
        if rank == 0:
            (out / "summary.json").unlink(missing_ok=True)


def write_summary(path: Path | str, summary: Mapping[str, Any]) -> None:
    """Write `summary` as JSON; NaN and infinity become null. Call it on one rank."""
    text = to_json(summary, indent=2, inf_nan_mode="null", fallback=lambda array: array.tolist())
    replace_file(Path(path), text + b"\n")
