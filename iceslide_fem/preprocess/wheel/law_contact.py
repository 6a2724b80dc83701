"""Sliding contact below a wheel under any law of the common protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step, advance
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.preprocess.wheel.brush import Ends, ends_of
from iceslide_fem.preprocess.wheel.contact import SLOWEST, Onset, Slid
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene.materials import BOTTOMLESS, ICE, Ground, Solid

METHOD = INTEGRATORS["sdirk2"]
SHORTEST = 1e-9  # of a pixel's time


class Passing(NamedTuple):
    """Lines in one pixel: sliding speed (m/s, 0 at rest), and pressure (Pa) at both ends, (n,)."""

    speed: Array
    first: Array
    last: Array

    def at(self, fraction: float) -> Array:
        """Pressure at a fraction of the pixel, Pa."""
        return np.asarray(self.first + fraction * (self.last - self.first))


@dataclass(frozen=True)
class LawContact:
    """Sliding contact under `law` on ice of a temperature (K).

    film_height: initial, for laws with films, m; tolerance: target relative error of mu; ground:
    below the ice.
    """

    law: InterfaceLaw
    temperature: float
    solid: Solid = ICE
    film_height: float = 70e-9
    tolerance: float = 1e-2
    ground: Ground = BOTTOMLESS

    @property
    def passes(self) -> int:
        """1: what passes leave behind is a film's."""
        return 1

    def after(self, slid: Slid) -> LawContact:
        """The same."""
        return self

    def onset(self, pressure: Array, dx: Array, passing: Array, speed: Array) -> Onset:
        """Stress of the law's initial state."""
        at_ends = ends_of(pressure, pressure > 0.0)
        begins, rests = (
            Ends(*(self._first(end, at) for end in at_ends))
            for at in (speed, np.full_like(speed, SLOWEST))
        )
        return Onset(begins, rests)

    def _first(self, pressure: Array, speed: Array) -> Array:
        flat, speeds = pressure.ravel(), np.repeat(speed, pressure.shape[1])
        shear, *_ = self.law.at_start(self.film_height, flat.size)(flat, speeds)
        return np.where(pressure > 0.0, shear.reshape(pressure.shape), 0.0)

    def slid(self, pressure: Array, slides: Mask, dx: Array, passing: Array, speed: Array) -> Slid:
        """Each line is one piece of ice that passes pixel after pixel; all have the same steps."""
        pressure = np.where(slides, pressure, 0.0)
        lines, columns = pressure.shape
        touching, dt = pressure > 0.0, dx / passing
        temperature = np.full(lines, self.temperature)
        times = columns * np.array([dt.min(), dt.max()])
        ice = Column(temperature, times, solid=self.solid, ground=self.ground)
        log_height, squeezed, internal = self.law.initial(self.film_height, lines)
        heat = ice.initial(lines), INSULATED.initial(lines)
        state = InterfaceState(log_height, squeezed, *heat, internal, self.law.untouched(lines))
        at_ends = ends_of(pressure, touching)
        stress, found = np.zeros((2, lines, columns)), np.zeros((4, lines, columns))
        for i in range(columns):
            here = touching[:, i]
            pixel = Passing(np.where(here, speed, 0.0), *(end[:, i] for end in at_ends))
            first = self._stress(state, pixel, 0.0, ice)
            state, step = self._passed(state, pixel, dt, ice)
            last = self._stress(state, pixel, 1.0, ice)
            stress[:, :, i] = np.where(here, [first, last], 0.0)
            warm = ice.surface_temperature(state.ice)
            switches = step.last.melting, step.last.saturated
            found[:, :, i] = warm, self.law.film_height(state), *switches
        warm, height, melting, saturated = found
        return Slid(Ends(*stress), warm, height, melting > 0.0, saturated > 0.0)

    def _stress(self, state: InterfaceState, pixel: Passing, fraction: float, ice: Column) -> Array:
        """Friction stress (Pa) at a fraction of a pixel. Raises SimulationStopped."""
        shear = self.law.loads(pixel.at(fraction), pixel.speed, state.age).shear(state, ice)
        if self.law.fault:
            raise SimulationStopped(self.law.fault)
        return np.asarray(shear)

    def _passed(
        self, state: InterfaceState, pixel: Passing, dt: Array, ice: Column
    ) -> tuple[InterfaceState, Step]:
        """State after a pixel that passes in `dt` (s), and the last step. Raises
        SimulationStopped.
        """
        done, trial = 0.0, 1.0
        scale = np.full(pixel.speed.size, self.solid.melting_temperature - self.temperature)
        while True:
            trial = min(trial, 1.0 - done)
            ends = (
                self.law.loads(pixel.at(fraction), pixel.speed, state.age)
                for fraction in (done, done + trial)
            )
            first, last = ends
            try:
                step = advance(state, first, last, trial * dt, ice, METHOD)
                error = float(last.local_error(step, ice, INSULATED, scale).max())
            except NotConverged:
                error = np.inf
            if self.law.fault:
                raise SimulationStopped(self.law.fault)
            error /= METHOD.allowed * self.tolerance
            following = trial * float(step_factor(error, METHOD.estimate_order))
            if error <= 1.0:
                state, done = step.state, done + trial
                if done >= 1.0:
                    return state, step
            elif following < SHORTEST:
                raise SimulationStopped(
                    f"the friction law {self.law.name} cannot be advanced below the wheel: even "
                    f"steps of {following * dt.min():.2g} s miss the tolerance"
                )
            trial = following
