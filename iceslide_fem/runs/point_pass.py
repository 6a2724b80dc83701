"""One pass of a point over ice, with a row per step."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np

from iceslide_fem.film.conditions import FIXED_STEPS, exposure, ice_model, rubber_columns
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.film.point import CONDENSED, Span, Steps, ice_below, integrate
from iceslide_fem.film.point_result import PointResult, Record
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.runge_kutta import INTEGRATORS, Integrator
from iceslide_fem.laws.points import LawDrive
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.output.table import HistoryRow, row_of
from iceslide_fem.output.water import PointWater
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene
from iceslide_fem.scene.course import SAMPLED
from iceslide_fem.scene.materials import Solid

# Energies of a step, J/m2: friction work, then its sinks.
ROUNDING = 1e-12  # of the duration
LONGEST_STEP = 0.01  # of the duration, under a law without films: for smooth curves
ENERGIES = ("friction_work", "ice_heat", "rubber_heat", "latent_heat", "hysteresis_heat")


class PointRows:
    """Rows of one point under `law`, one per accepted step from t = 0, with the block's forces.

    The latent heat is that of the water that there is: in the film, in the voids, and flowed out of
    them. The energy balance then compares it with the heat of the stages.
    """

    def __init__(self, scene: Scene, law: InterfaceLaw) -> None:
        self._scene, self._law = scene, law
        self._area = scene.rubber.length * scene.rubber.width
        self._water = PointWater(law, self._area)
        self._energies = dict.fromkeys(ENERGIES, 0.0)  # J
        self._squeezed = self._flowed_out = self._first_water = 0.0  # m3
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
            self._flowed_out += area * float(step.flowed_out[0])
            for name in ENERGIES:
                self._energies[name] += area * float(getattr(step, name)[0])
        if self._law.has_film:
            water = area * float((self._law.film_height(state) + state.squeezed_height)[0])
            if step is None:
                self._first_water = water
            melted = water + self._flowed_out - self._first_water
            self._energies["latent_heat"] = self._scene.ice.solid.melting_enthalpy * melted
        pressure = load.pressures.at(time)
        squeezed = float(self._law.water_height(state)[0])
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
            "water_squeezed_m3": self._squeezed,
            "water_below_m3": squeezed * area,
        }
        energies = {f"{name}_J": energy for name, energy in self._energies.items()}
        internal = self._law.reported(state.internal, np.array([pressure]), state.age)
        of_law = {name: float(values[0]) for name, values in internal.items()}
        of_law |= self._water.columns(state, pressure, step)
        row = row_of(load, time, known | energies, of_law)
        self.rows.append(row._replace(energy_imbalance=imbalance(row, self._scene.ice.solid)))


def imbalances(work: Array | float, heats: Sequence[Array | float], there: Array | float) -> Array:
    """Errors of energy balances of points over their largest energies, any shape.

    work: of friction; heats: into ice, rubber, melting and hysteresis; there: latent heat of the
    water in film and voids, of which steps lose a fraction. Any unit.
    """
    largest = reduce(np.maximum, [work, there, *map(np.abs, heats)])
    missing = np.asarray(work - sum(heats), dtype=float)
    return np.divide(missing, largest, out=np.zeros_like(missing), where=largest > 0.0)


def imbalance(row: HistoryRow, ice: Solid) -> float:
    """That of a row."""
    heats = row.ice_heat_J, row.rubber_heat_J, row.latent_heat_J, row.hysteresis_heat_J
    area, film = row.normal_force_N / row.nominal_pressure_Pa, np.nan_to_num(row.film_height_m)
    there = ice.melting_enthalpy * (area * film + row.water_below_m3)
    return float(imbalances(row.friction_work_J, heats, there))


def first_state(
    scene: Scene,
    law: InterfaceLaw,
    ice: Column | HalfSpace,
    rubber: RubberHeat | None = None,
) -> InterfaceState:
    """Films on cold ice below `rubber` that has not touched, by default that of one pass."""
    log_height, squeezed, internal = law.initial(scene.initial_height, 1)
    heats = ice.initial(1), (rubber or rubber_columns(scene)).initial(1)
    return InterfaceState(log_height, squeezed, *heats, internal, law.untouched(1))


def ice_of(scene: Scene) -> Column | HalfSpace:
    """The ice below a point of one pass."""
    ice = ice_below(ice_model(scene), scene.ice.temperature, exposure(scene), scene.ice.solid)
    return ice.condensed(CONDENSED * scene.numerics.tolerance)


def one_pass(
    scene: Scene,
    law: InterfaceLaw,
    ice: Column | HalfSpace,
    start: InterfaceState | None = None,
    shown: bool = True,
    rubber: RubberHeat | None = None,
) -> tuple[list[HistoryRow], PointResult]:
    """Rows and result of a pass, from films on cold `ice` or from the state `start`.

    shown: whether to show progress; rubber: by default that of one pass. Raises SimulationStopped.
    """
    numerics, load, duration = scene.numerics, scene.load, exposure(scene)
    near = SAMPLED * numerics.tolerance
    drive = LawDrive(law, load.pressures.sampled(near), load.speeds.sampled(near), np.ones(1))
    begin = first_state(scene, law, ice, rubber) if start is None else start
    history = PointRows(scene, law)
    loads = drive.loads(np.zeros(1), begin.age)
    warm = float(ice.surface_temperature(begin.ice)[0])
    history.add(0.0, begin, float(loads.shear(begin, ice)[0]), warm)

    with LongTask(duration, shown=shown and rank() == 0) as task:

        def observe(record: Record) -> None:
            state, end = record.state, float(record.time[0]) + float(record.dt[0])
            history.add(
                duration if abs(end - duration) <= ROUNDING * duration else end,
                state,
                float(record.loads.shear(state, record.ice)[0]),
                float(record.ice.surface_temperature(state.ice)[0]),
                record.step,
                bool(record.melting[0]),
                bool(record.full[0]),
            )
            if not shown:
                return
            row = history.rows[-1]
            where = f"t = {1e3 * row.time_s:.3f} of {1e3 * duration:g} ms"
            task.show(row.time_s, where, f"mu {row.mu:.3f}", f"step {1e3 * row.step_s:.3g} ms")

        T_0, T_m = (
            np.full(1, one) for one in (scene.ice.temperature, scene.ice.melting_temperature)
        )
        span = Span(np.full(1, duration), T_0, T_m, scene.ice.solid)
        steps = Steps(numerics.tolerance, *step_lengths(scene, law))
        above = rubber or rubber_columns(scene)
        result = integrate(drive, begin, span, ice, above, steps, (), observe, scene.water.table)
    return history.rows, result


def step_lengths(scene: Scene, law: InterfaceLaw) -> tuple[Integrator, float | None, float]:
    """Integrator, length of fixed steps (s) or None, and longest step (s)."""
    numerics, duration = scene.numerics, exposure(scene)
    integrator = INTEGRATORS[numerics.film_integrator]
    if not integrator.estimate:
        return integrator, numerics.max_step or duration / FIXED_STEPS, np.inf
    longest = np.inf if law.has_film else LONGEST_STEP * duration
    return integrator, None, numerics.max_step or longest
