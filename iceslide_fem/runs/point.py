"""A run at a point, with the same history and summary as slices and blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iceslide_fem.film.doubts import doubts, unbalanced
from iceslide_fem.film.point_result import PointResult
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.laws.table import law_of
from iceslide_fem.output.table import HistoryRow, PassRow
from iceslide_fem.runs.entering import rows_over_ageing
from iceslide_fem.runs.point_pass import ice_of, one_pass
from iceslide_fem.runs.point_passes import block_rows, mean_summary, passes_history
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene


def point_history(
    scene: Scene, observe: Callable[[PassRow], None] = lambda row: None
) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Run `scene` at its nominal pressure; rows of `history.csv` from t = 0, and the results.

    The rubber's length and width only convert stresses (Pa) to forces (N) and J/m2 to J; contact is
    complete. Sliding ice is simulated for the time that it is below the block, and the rows are
    those of the block (`block_rows`). `observe` is called with every pass, if there are several.
    Raises SimulationStopped if a step fails.
    """
    law = law_of(scene)
    if scene.several_passes:
        rows, entries = passes_history(scene, law, observe)
    else:
        rows, entries = _one_history(scene, law)
    missing = rows[-1].energy_imbalance
    entries["warnings"] += unbalanced(missing, "the largest energy")
    return rows, entries | {"energy_imbalance": missing}


def _one_history(scene: Scene, law: InterfaceLaw) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows and results of one pass."""
    passes = scene.ice.motion == "sliding"
    ages = passes and law.untouched(1).size > 0
    rows, result = rows_over_ageing(scene, law) if ages else one_pass(scene, law, ice_of(scene))
    entries = point_summary(result, 0)
    thinnest = min(row.film_height_m for row in rows)
    entries["warnings"] = []
    if np.isfinite(thinnest):  # else the law has no films
        melts = float(entries["melt_onset_s"] is not None)
        dry, wet = scene.film.dry_stress is not None, scene.ice.is_wet
        entries["warnings"] = doubts(thinnest, float(result.mu_peak[0]), melts, dry, wet)
    if passes:
        rows = rows if ages else block_rows(rows, scene)
        entries |= mean_summary(rows)
    return rows, entries


def point_doubts(result: PointResult, number: int, dry: bool) -> list[str]:
    """Warnings for the summary of one condition; dry: whether it has dry friction.

    The film of the largest mu is the thinnest; with dry friction its height counts as none.
    """
    mu, thinnest = float(result.mu_peak[number]), 1.0 / float(result.peak_shearing[number])
    melts = not np.isnan(result.melt_onset[number])
    return doubts(thinnest, mu, float(melts), dry)


def point_summary(result: PointResult, number: int) -> dict[str, Any]:
    """Entries of `summary.json` for one condition, without energies."""

    def when(times: Array) -> float | None:
        return None if np.isnan(times[number]) else float(times[number])

    return {
        "mu_peak": float(result.mu_peak[number]),
        "mu_peak_time_s": float(result.mu_peak_time[number]),
        "mu_mean": float(result.mu_mean[number]),
        "mu_end": float(result.mu_end[number]),
        "melt_onset_s": when(result.melt_onset),
        "saturation_s": when(result.saturation),
        "steps": int(result.steps[number]),
        "rejected_steps": int(result.rejected[number]),
    }
