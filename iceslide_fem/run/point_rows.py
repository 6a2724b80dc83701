"""Rows of `history.csv` at a point, under any friction law."""

from __future__ import annotations

from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.output.table import HistoryRow, row_of
from iceslide_fem.scene import Scene
from iceslide_fem.scene.materials import ZERO_CELSIUS


class PointRows:
    """Rows of one point under `law`, one per accepted step from t = 0; forces are the block's."""

    def __init__(self, scene: Scene, law: InterfaceLaw) -> None:
        self._scene, self._law = scene, law
        self._area = scene.rubber.length * scene.rubber.width
        self._work = self._ice_heat = self._rubber_heat = self._latent_heat = 0.0
        self.rows: list[HistoryRow] = []

    def add(
        self,
        time: float,
        state: InterfaceState,
        shear: float,
        temperature: float,
        step: Step | None = None,
        melting: bool = False,
        saturated: bool = False,
    ) -> None:
        """Enter the point at `time` (s): its state, shear (Pa) and the ice's surface temperature
        (K); `step` led there, None at t = 0.
        """
        area, load = self._area, self._scene.load
        dt = 0.0
        if step is not None:
            dt = time - self.rows[-1].time_s
            self._work += area * float(step.friction_work[0])
            self._ice_heat += area * float(step.ice_heat[0])
            self._rubber_heat += area * float(step.rubber_heat[0])
            self._latent_heat += area * float(step.latent_heat[0])
        work = self._work
        missing = work - self._ice_heat - self._rubber_heat - self._latent_heat
        pressure, squeezed = load.pressures.at(time), float(state.squeezed_height[0])
        known = {
            "time_s": time,
            "step_s": dt,
            "slip_m": load.speeds.integral(time),
            "mu": shear / pressure,
            "film_height_m": float(self._law.film_height(state)[0]),
            "squeezed_height_m": squeezed,
            "surface_temperature_C": temperature - ZERO_CELSIUS,
            "contact_fraction": 1.0,
            "nominal_pressure_Pa": pressure,
            "speed_m_per_s": load.speeds.at(time),
            "normal_force_N": pressure * area,
            "friction_force_N": shear * area,
            "melted_fraction": float(melting),
            "saturated_fraction": float(saturated),
            "friction_work_J": work,
            "ice_heat_J": self._ice_heat,
            "rubber_heat_J": self._rubber_heat,
            "latent_heat_J": self._latent_heat,
            "energy_imbalance": missing / work if work else 0.0,
            "water_squeezed_m3": squeezed * area,
            "water_below_m3": squeezed * area,
        }
        internal = self._law.reported(state.internal)
        of_law = {name: float(values[0]) for name, values in internal.items()}
        self.rows.append(row_of(known, of_law))
