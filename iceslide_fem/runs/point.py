"""A run at a point, with the same history and summary as slices and blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem.film.conditions import (
    exposure,
    ice_model,
    scene_conditions,
    simulation_settings,
)
from iceslide_fem.film.doubts import doubts
from iceslide_fem.film.point import Conditions, PointResult, ice_below
from iceslide_fem.laws.aged_film import AgedFilm
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.laws.table import law_of
from iceslide_fem.output.table import HistoryRow, PassRow
from iceslide_fem.runs.point_pass import law_pass, one_pass
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
    if isinstance(law, AgedFilm):
        law = law.film  # a point's contact age is the time (`film.aged_loads`)
    if scene.several_passes:
        rows, entries = passes_history(scene, law, observe)
        return rows, entries | {"energy_imbalance": rows[-1].energy_imbalance}
    rows, entries = _of_film(scene, law) if law.has_film else _of_law(scene, law)
    if scene.ice.motion == "sliding":
        rows = block_rows(rows, scene)
        entries |= mean_summary(rows)
    return rows, entries | {"energy_imbalance": rows[-1].energy_imbalance}


def _of_film(scene: Scene, law: InterfaceLaw) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows and results of the film law, whose steps end on melt onset and saturation."""
    rows, result = one_pass(scene, law, scene_conditions(scene), simulation_settings(scene))
    entries = point_summary(result, 0)
    thinnest = min(row.film_height_m for row in rows)
    melting = float(entries["melt_onset_s"] is not None)
    dry = scene.film.dry_stress is not None
    entries["warnings"] = doubts(thinnest, float(result.mu_peak[0]), melting, dry)
    return rows, entries


def _of_law(scene: Scene, law: InterfaceLaw) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows and results of a law without film events."""
    duration = exposure(scene)
    ice = ice_below(ice_model(scene), scene.ice.temperature, duration, scene.ice.solid)
    rows, end = law_pass(scene, law, ice)
    mu, time = ([getattr(row, name) for row in rows] for name in ("mu", "time_s"))
    peak, melts = int(np.argmax(mu)), not np.isnan(end.melt_onset)
    thinnest = min(row.film_height_m for row in rows)
    found = []
    if np.isfinite(thinnest):  # else the law has no films
        found = doubts(thinnest, mu[peak], float(melts), scene.ice.is_wet)
    return rows, {
        "mu_peak": mu[peak],
        "mu_peak_time_s": time[peak],
        "mu_mean": float(trapezoid(mu, time)) / duration,
        "mu_end": mu[-1],
        "melt_onset_s": end.melt_onset if melts else None,
        "saturation_s": next((row.time_s for row in rows if row.saturated_fraction), None),
        "steps": len(rows) - 1,
        "rejected_steps": end.rejected,
        "warnings": found,
    }


def point_doubts(conditions: Conditions, result: PointResult, number: int) -> list[str]:
    """Warnings for the summary of one condition; mu = k eta v / (p h) is largest at least h."""
    mu = float(result.mu_peak[number])
    viscous = float(conditions.loads().viscous[number])
    thinnest = viscous / (mu * float(conditions.pressure[number]))
    melts, dry = not np.isnan(result.melt_onset[number]), conditions.limit is not None
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
