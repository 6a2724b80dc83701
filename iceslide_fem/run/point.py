"""One scene on the point rung: the same history and summary as the rungs with rubber."""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.film.conditions import rubber_columns, scene_conditions, simulation_settings
from iceslide_fem.film.ice_heat import Column, HalfSpace
from iceslide_fem.film.point import ICE_MODELS, Conditions, PointResult, Record, simulate
from iceslide_fem.materials import MELTING_TEMPERATURE
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.scene import Scene


def point_history(scene: Scene) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Run `scene` at its nominal pressure; rows of `history.csv` from t = 0, and the results.

    The rubber's length and width only turn stresses (Pa) into forces (N) and works (J/m2) into
    J; contact is complete. Raises SimulationStopped where the film cannot be advanced.
    """
    conditions = scene_conditions(scene)
    history = _History(scene, conditions)
    settings = simulation_settings(scene)
    result = simulate(conditions, observe=history.add, rubber=rubber_columns(scene), **settings)
    imbalance = {"energy_imbalance": history.rows[-1].energy_imbalance}
    return history.rows, point_summary(result, 0) | imbalance


class _History:
    """Rows of the history, one per accepted step from t = 0."""

    def __init__(self, scene: Scene, conditions: Conditions) -> None:
        self._scene = scene
        self._area = scene.rubber.length * scene.rubber.width
        self._shear_height = float(conditions.loads().viscous[0])
        self._ice: Column | HalfSpace = ICE_MODELS[scene.ice.heat](
            conditions.temperature, conditions.duration
        )
        self._work = self._ice_heat = self._rubber_heat = self._latent_heat = 0.0
        self.rows = [self._row(0.0, 0.0, scene.film.initial_height, 0.0, scene.ice.temperature)]

    def add(self, record: Record) -> None:
        """Enter an accepted step."""
        step, dt = record.step, float(record.dt[0])
        self._work += self._area * float(step.friction_work[0])
        self._ice_heat += self._area * float(step.ice_heat[0])
        self._rubber_heat += self._area * float(step.rubber_heat[0])
        self._latent_heat += self._area * float(step.latent_heat[0])
        row = self._row(
            float(record.time[0]) + dt,
            dt,
            float(np.exp(step.state.log_height[0])),
            float(step.state.squeezed_height[0]),
            float(self._ice.surface_temperature(step.state.ice)[0]),
            bool(record.melting[0]),
            bool(record.full[0]),
        )
        self.rows.append(row)

    def _row(
        self,
        time: float,
        dt: float,
        height: float,
        squeezed: float,
        temperature: float,
        melting: bool = False,
        saturated: bool = False,
    ) -> HistoryRow:
        load = self._scene.load
        shear = self._shear_height / height
        missing = self._work - self._ice_heat - self._rubber_heat - self._latent_heat
        return HistoryRow(
            time_s=time,
            step_s=dt,
            slip_m=load.speed * time,
            mu=shear / load.pressure,
            film_height_m=height,
            squeezed_height_m=squeezed,
            surface_temperature_C=temperature - MELTING_TEMPERATURE,
            contact_fraction=1.0,
            normal_force_N=load.pressure * self._area,
            friction_force_N=shear * self._area,
            plate_displacement_m=0.0,
            melted_fraction=float(melting),
            saturated_fraction=float(saturated),
            friction_work_J=self._work,
            load_work_J=0.0,
            ice_heat_J=self._ice_heat,
            rubber_heat_J=self._rubber_heat,
            latent_heat_J=self._latent_heat,
            elastic_energy_J=0.0,
            kinetic_energy_J=0.0,
            energy_imbalance=missing / self._work if self._work else 0.0,
            newton_iterations=0,
        )


def point_summary(result: PointResult, number: int) -> dict[str, Any]:
    """Entries of `summary.json` for one of the conditions, but for its energies."""

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
