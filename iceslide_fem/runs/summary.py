"""The summary of a sliding block, collected during the run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem.film.doubts import doubts, unbalanced
from iceslide_fem.mechanics.failure import FOLDED, TIPPED
from iceslide_fem.output.history import outside_table, thinnest_film
from iceslide_fem.runs.pace import Observation

# Thresholds of warnings in the summary.
LARGEST_OUTSIDE = 0.1  # fraction of the contact area outside the table of k, D and H_V


class Results:
    """Observer that collects the summary row by row."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float]] = []
        self.melt_onset: float | None = None
        self.saturation: float | None = None
        self.peak, self.peak_time = -math.inf, 0.0  # of mu, and its time (s)
        self.rejected = self.iterations = self.dofs = 0
        self.imbalance = 0.0
        self.outside_table_fraction = 0.0
        self.sipe_opening = math.inf
        self.bottom, self.sides = 1.0, 0.0  # least bottom contact, largest side load
        self.thinnest_film = math.inf
        self.passes, self.last_pass = 0, math.nan  # finished; mean mu of the last
        self.melted = 0.0  # largest fraction of the contact
        self.dry = self.wet = False  # whether the law has dry friction, or water without melting

    def __call__(self, step: Observation) -> None:
        """Add t = 0 or an accepted step. Collective."""
        row, block, now = step.row, step.sliding.block, step.history_row.time_s
        if row.mu > self.peak:
            self.peak, self.peak_time = row.mu, now
        self.rows.append((row.time_s, row.mu))
        self.rejected += step.accepted.rejected if step.accepted else 0
        self.iterations += row.newton_iterations
        self.imbalance = row.energy_imbalance
        self.melted = max(self.melted, row.melted_fraction)
        if self.melt_onset is None and row.melted_fraction > 0.0:
            self.melt_onset = now
        if self.saturation is None and row.saturated_fraction > 0.0:
            self.saturation = now
        self.dry, self.wet = block.scene.film.dry_stress is not None, block.scene.ice.is_wet
        self.thinnest_film = min(self.thinnest_film, thinnest_film(step.sliding))
        if step.solved:
            posture = block.posture()
            self.bottom = min(self.bottom, posture.bottom)
            self.sides = max(self.sides, posture.sides)
            self.outside_table_fraction = outside_table(block, step.sliding.current.contact)
            self.sipe_opening = min(self.sipe_opening, block.smallest_opening(self.sipe_opening))

    def state(self) -> dict[str, Any]:
        """Everything collected so far."""
        return vars(self).copy()

    def restore(self, state: dict[str, Any]) -> None:
        """Restore what was collected."""
        vars(self).update(state, rows=[tuple(row) for row in state["rows"]])

    def entries(self) -> dict[str, Any]:
        """Entries of `summary.json` from the history; empty without rows."""
        if not self.rows:
            return {}
        time, mu = np.array(self.rows).T  # sliding time, without rests
        span = time[-1] - time[0]
        passes = {"passes": self.passes, "mu_mean_last_pass": self.last_pass}
        return {
            "mu_peak": float(self.peak),
            "mu_peak_time_s": float(self.peak_time),
            "mu_mean": float(trapezoid(mu, time) / span) if span > 0.0 else float(mu[0]),
            "mu_end": float(mu[-1]),
            "melt_onset_s": self.melt_onset,
            "melted_fraction": float(self.melted),
            "saturation_s": self.saturation,
            "steps": len(self.rows) - 1,
            "rejected_steps": self.rejected,
            "newton_iterations": self.iterations,
            "dofs": self.dofs,
            "energy_imbalance": self.imbalance,
            "outside_table_fraction": self.outside_table_fraction,
            "sipe_opening_m": self.sipe_opening if math.isfinite(self.sipe_opening) else None,
            "warnings": self._warnings(),
            **(passes if self.passes else {}),
        }

    def _warnings(self) -> list[str]:
        """Warnings on these results."""
        found = unbalanced(self.imbalance, "the friction work")
        if self.bottom < TIPPED:
            found.append(
                f"the block tipped: once only {self.bottom:.0%} of its bottom touched the ice"
            )
        if self.sides > FOLDED:
            found.append(
                f"an edge folded under: the sides carried up to {self.sides:.0%} of the load"
            )
        if self.outside_table_fraction > LARGEST_OUTSIDE:
            found.append(
                f"at the end {self.outside_table_fraction:.0%} of the contact area was under "
                "pressures that the table of k, D and H_V does not cover: its nearest end was taken"
            )
        if math.isfinite(self.thinnest_film):  # else the law has no film
            found += doubts(self.thinnest_film, self.peak, self.melted, self.dry, self.wet)
        return found
