"""Rows of `history.csv` at a point, under any friction law."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import sub

import numpy as np

from iceslide_fem.film.contact_age import CONTACT_AREA
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.output.table import HistoryRow, row_of
from iceslide_fem.output.water import PointWater
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene

# Energies of a step, J/m2: friction work, then its sinks.
ENERGIES = ("friction_work", "ice_heat", "rubber_heat", "latent_heat")


class PointRows:
    """Rows of one point under `law`, one per accepted step from t = 0, with the block's forces.

    contact_area: k as a function of time (s), with contact age.
    """

    def __init__(
        self,
        scene: Scene,
        law: InterfaceLaw,
        contact_area: Callable[[float], float] | None = None,
    ) -> None:
        self._scene, self._law, self._contact_area = scene, law, contact_area
        self._area = scene.rubber.length * scene.rubber.width
        self._water = PointWater(law, self._area)
        self._energies = dict.fromkeys(ENERGIES, 0.0)  # J
        self._squeezed = 0.0  # m3
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
        """Add the point at `time` (s): state, shear (Pa) and surface temperature of the ice (K).

        step: the step that ends there, None at t = 0.
        """
        area, load = self._area, self._scene.load
        dt = 0.0
        if step is not None:
            dt = time - self.rows[-1].time_s
            self._squeezed += area * float(step.squeezed[0] + step.flowed_out[0])
            for name in ENERGIES:
                self._energies[name] += area * float(getattr(step, name)[0])
        work, *taken = self._energies.values()
        missing = reduce(sub, taken, work)
        pressure, squeezed = load.pressures.at(time), float(state.squeezed_height[0])
        known = {
            "step_s": dt,
            "mu": shear / pressure,
            "film_height_m": float(self._law.film_height(state)[0]),
            "squeezed_height_m": squeezed,
            "surface_temperature_C": temperature - ZERO_CELSIUS,
            "contact_fraction": 1.0,
            "normal_force_N": pressure * area,
            "friction_force_N": shear * area,
            "melted_fraction": float(melting),
            "saturated_fraction": float(saturated),
            "energy_imbalance": missing / work if work else 0.0,
            "water_squeezed_m3": self._squeezed,
            "water_below_m3": squeezed * area,
        }
        energies = {f"{name}_J": energy for name, energy in self._energies.items()}
        internal = self._law.reported(state.internal, np.array([pressure]))
        of_law = {name: float(values[0]) for name, values in internal.items()}
        if self._contact_area is not None:
            of_law[CONTACT_AREA] = self._contact_area(time)
        of_law |= self._water.columns(state, pressure, step)
        self.rows.append(row_of(load, time, known | energies, of_law))
