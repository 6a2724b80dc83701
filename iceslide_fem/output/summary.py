"""The folder of a run, and its summary as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.files import replace_file, writing


def begin_run(out: Path, rank: int) -> None:
    """Make the directory of a run; the summary of an earlier one there goes."""
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
        if rank == 0:
            (out / "summary.json").unlink(missing_ok=True)


def write_summary(path: Path | str, summary: Mapping[str, Any]) -> None:
    """Write `summary` as JSON; NaN and infinity become null. Call it on one rank."""
    replace_file(Path(path), json.dumps(_plain(summary), indent=2, ensure_ascii=False) + "\n")


def _plain(value: Any) -> Any:
    """`value` as JSON can hold it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int) else str(value)
