"""One scene with a law of its own on the point rung: the same history and summary."""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.film.conditions import FIXED_STEPS, exposure, ice_model, rubber_columns
from iceslide_fem.film.integrators import INTEGRATORS
from iceslide_fem.film.own_law import OwnFriction
from iceslide_fem.film.own_point import Moment, moments
from iceslide_fem.film.point import ice_below
from iceslide_fem.laws.bound import BoundLaw
from iceslide_fem.materials import ZERO_CELSIUS
from iceslide_fem.output.table import HistoryRow, row_of
from iceslide_fem.scene import Scene
from iceslide_fem.scene.course import SAMPLED


def own_history(scene: Scene, law: BoundLaw) -> tuple[list[HistoryRow], dict[str, Any]]:
    """Rows of `history.csv` from t = 0, and the results; of ice that slides until it has passed.

    Raises SimulationStopped.
    """
    numerics, load, duration = scene.numerics, scene.load, exposure(scene)
    ice = ice_below(ice_model(scene), scene.ice.temperature, duration, scene.ice.solid)
    integrator = INTEGRATORS[numerics.film_integrator]
    area = scene.rubber.length * scene.rubber.width
    rows: list[HistoryRow] = []
    totals = np.zeros(4)
    melt_onset, work_mu, refused = None, 0.0, 0

    def row(moment: Moment) -> HistoryRow:
        step = moment.step
        melting = step is not None and bool(step.last.melting[0])
        work, taken = totals[0], totals[1:].sum()
        pressure = load.pressures.at(moment.time)
        warm = float(ice.surface_temperature(moment.state.ice)[0])
        known = {
            "time_s": moment.time,
            "step_s": moment.dt,
            "slip_m": load.speeds.integral(moment.time),
            "mu": float(moment.shear[0]) / pressure,
            "film_height_m": np.nan,
            "surface_temperature_C": warm - ZERO_CELSIUS,
            "contact_fraction": 1.0,
            "nominal_pressure_Pa": pressure,
            "speed_m_per_s": load.speeds.at(moment.time),
            "normal_force_N": pressure * area,
            "friction_force_N": float(moment.shear[0]) * area,
            "melted_fraction": float(melting),
            "friction_work_J": work,
            "ice_heat_J": totals[1],
            "rubber_heat_J": totals[2],
            "latent_heat_J": totals[3],
            "energy_imbalance": (work - taken) / work if work else 0.0,
        }
        memory = dict(zip(law.columns, moment.state.memory[:, 0].tolist(), strict=True))
        return row_of(known, memory)

    walk = moments(
        OwnFriction(law, scene.ice.temperature),
        load.pressures.sampled(SAMPLED * numerics.tolerance),
        load.speeds.sampled(SAMPLED * numerics.tolerance),
        duration,
        ice,
        integrator,
        numerics.tolerance,
        scene.ice.melting_temperature - scene.ice.temperature,
        rubber_columns(scene),
        numerics.max_step or (None if integrator.estimate else duration / FIXED_STEPS),
    )
    for moment in walk:
        refused += moment.refused
        if (step := moment.step) is not None:
            mu = float(moment.shear[0]) / load.pressures.at(moment.time)
            work_mu += 0.5 * moment.dt * (rows[-1].mu + mu)
            kinds = (step.friction_work, step.ice_heat, step.rubber_heat, step.latent_heat)
            totals += [area * float(kind[0]) for kind in kinds]
            if melt_onset is None and step.last.melting[0]:
                melt_onset = moment.time
        rows.append(row(moment))
    curve = [one.mu for one in rows]
    peak = int(np.argmax(curve))
    return rows, {
        "mu_peak": curve[peak],
        "mu_peak_time_s": rows[peak].time_s,
        "mu_mean": work_mu / duration,
        "mu_end": curve[-1],
        "melt_onset_s": melt_onset,
        "saturation_s": None,
        "steps": len(rows) - 1,
        "rejected_steps": refused,
        "warnings": [],
    }
