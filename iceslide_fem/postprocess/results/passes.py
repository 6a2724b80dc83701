"""Histories of passes over the same ice: one pass alone, and sliding time without the rests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem.runtime.arrays import Array

PASS = "pass"  # the column that says which one a row is of


def sliding_time(history: Mapping[str, Array]) -> Array:
    """Time (s) of every row without the rests between passes."""
    return history["time_s"] if PASS not in history else np.cumsum(history["step_s"])


def mean_over_sliding(history: Mapping[str, Array], column: str) -> float:
    """Mean of a `column` over the time in which the rubber slides; rests do not count."""
    values = history[column]
    if PASS not in history:
        spans = [slice(None)]
    else:
        ends = [*(np.flatnonzero(np.diff(history[PASS])) + 1), values.size]
        spans = [slice(first, end) for first, end in zip([0, *ends], ends, strict=False)]
    time = history["time_s"]
    whole = sum(float(trapezoid(values[span], time[span])) for span in spans)
    slid = float(sliding_time(history)[-1])
    return whole / slid if slid else float(values[0])


def history_of(history: Mapping[str, Array], number: int, start: float) -> dict[str, Array]:
    """The rows of one pass; their times begin at its `start` (s)."""
    here = history[PASS] == number
    rows = {name: values[here] for name, values in history.items() if name != PASS}
    return rows | {"time_s": rows["time_s"] - start}


def summary_of(
    history: Mapping[str, Array], passes: Mapping[str, Array], number: int
) -> dict[str, Any]:
    """What a summary says of one pass, whose rows `history` has, from its row of `passes`."""
    row = {name: float(values[passes[PASS] == number][0]) for name, values in passes.items()}
    full = np.flatnonzero(history["saturated_fraction"] > 0.0)
    onset = row["melt_onset_s"]
    return {
        "mu_peak": row["mu_peak"],
        "mu_peak_time_s": float(history["time_s"][int(np.argmax(history["mu"]))]),
        "mu_mean": row["mu_mean"],
        "mu_end": row["mu_end"],
        "melt_onset_s": onset if np.isfinite(onset) else None,
        # a step ends where the free volume is full
        "saturation_s": float(history["time_s"][max(full[0] - 1, 0)]) if full.size else None,
        "steps": int(row["steps"]),
        "rejected_steps": int(row["rejected_steps"]),
    }
