"""The point level for scripts: many conditions in one call, as a dataset."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from iceslide_fem.api.runs import variables
from iceslide_fem.film.point import simulate
from iceslide_fem.film.point_conditions import RANGES, Conditions
from iceslide_fem.film.point_result import PointResult
from iceslide_fem.scene.fingerprint import versions, versions_in_words

# Names, with units, of what `Conditions` and `PointResult` call otherwise.
COLUMNS = {
    "pressure": "pressure_Pa",
    "speed": "speed_m_per_s",
    "temperature": "ice_temperature_K",
    "D": "D_m",
    "H_V": "H_V_m",
    "initial_height": "initial_height_m",
    "duration": "duration_s",
    "viscosity": "viscosity_Pa_s",
    "conductivity": "conductivity_W_per_m_K",
    "density": "density_kg_per_m3",
    "heat_capacity": "heat_capacity_J_per_kg_K",
    "melting_temperature": "melting_temperature_K",
    "latent_heat": "latent_heat_J_per_kg",
    "mu_peak_time": "mu_peak_time_s",
    "melt_onset": "melt_onset_s",
    "saturation": "saturation_s",
    "film_height": "film_height_m",
    "squeezed_height": "squeezed_height_m",
    "rejected": "rejected_steps",
}
_NOT_OF_POINTS = ("samples", "state")


def simulate_points(
    conditions: Conditions,
    *,
    times: ArrayLike = (),
    ice: str = "column",
    tolerance: float = 1e-3,
    integrator: str = "sdirk2",
) -> xr.Dataset:
    """Film and ice at the points `conditions` (see `Conditions.of`), from t = 0 to their duration.

    The dataset has a dimension `point`. `mu_mean`, `mu_peak`, `mu_peak_time_s`, `mu_end`,
    `melt_onset_s`, `saturation_s` (NaN where it does not happen), `film_height_m` and
    `squeezed_height_m` at the end, `steps` and `rejected_steps` are over it; with `times` (s,
    ascending) so is `mu` (times, points). The conditions are its coordinates, `pressure_Pa` say.

    `ice` is "column" or "half-space", `tolerance` the relative error of mu(t) that is aimed at,
    `integrator` a name in `iceslide_fem.film.runge_kutta.INTEGRATORS` that estimates its error.

    Raises `ValueError` where an argument is not possible, `SimulationStopped` where a step cannot
    be made.

    ```python
    import numpy as np
    import iceslide_fem

    conditions = iceslide_fem.Conditions.of(
        pressure=1e5, speed=np.linspace(1, 5, 100), temperature=269.15, k=0.3, D=6e-4, H_V=2e-6,
        initial_height=7e-8, duration=7e-3,
    )
    found = iceslide_fem.simulate_points(conditions, times=np.linspace(0, 7e-3, 50))
    found["mu_mean"].plot(x="speed_m_per_s")
    found["mu"].isel(point=0).plot()
    ```
    """
    sample_times = np.asarray(times, dtype=float)
    result = simulate(conditions, ice, tolerance, integrator, sample_times)
    names = [part.name for part in fields(PointResult) if part.name not in _NOT_OF_POINTS]
    data = variables({COLUMNS.get(name, name): getattr(result, name) for name in names}, "point")
    if sample_times.size:
        data |= variables({"time_s": sample_times}, "time_s")
        data |= variables({"mu": result.samples}, ("time_s", "point"))
    given = {COLUMNS.get(name, name): getattr(conditions, name) for name in RANGES}
    attributes = {
        "iceslide_fem": "points",
        "name": "points",
        "versions": versions_in_words(versions()),
        "ice": ice,
        "tolerance": tolerance,
        "integrator": integrator,
    }
    return xr.Dataset(data, variables(given, "point"), attributes)
