"""Histories of passes over the same ice: one pass alone, and sliding time without the rests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem.runtime.arrays import Array

PASS = "pass"  # column with the number of the pass
DECIMALS = 12  # of times (s) computed as sums of steps


def sliding_time(history: Mapping[str, Array]) -> Array:
    """Time (s) of every row without rests, as the sum of steps.

    Times in a table have ten digits, so long rests leave few digits within a pass.
    """
    if PASS not in history:
        return history["time_s"]
    return np.asarray(np.cumsum(history["step_s"]).round(DECIMALS))


def mean_over_sliding(history: Mapping[str, Array], column: str) -> float:
    """Mean of a `column` over the sliding time, without rests."""
    time, values = sliding_time(history), history[column]
    slid = float(time[-1])
    return float(trapezoid(values, time)) / slid if slid else float(values[0])


def history_of(history: Mapping[str, Array], number: int) -> dict[str, Array]:
    """The rows of one pass; their times begin with it."""
    here = {name: values[history[PASS] == number] for name, values in history.items()}
    time = sliding_time(here)
    del here[PASS]
    return here | {"time_s": time}


def summary_of(
    history: Mapping[str, Array], passes: Mapping[str, Array], number: int
) -> dict[str, Any]:
    """Summary of one pass from its `history` and its row of `passes`."""
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
