"""Loads of water films, and a film in one implicit stage.

    viscous coefficient   c = k eta v, so that tau = c / h        (5.29)
    squeeze rate          K3 = 8 p / (3 eta D^2)                  (6.5)

Equation numbers are those of R. Leonardi's thesis. With a temperature-dependent viscosity
(`viscosity`), loads use a constant eta_0, and ln(eta / eta_0) is an internal variable.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Step, error_norms
from iceslide_fem.film.law import FilmHistory, FilmStage, Surface, log_shearing
from iceslide_fem.film.limited_stage import limited_stage
from iceslide_fem.film.limiting_shear import LimitingShear
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.viscosity import VariableViscosity, consistent_viscosity
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.materials import WATER_VISCOSITY

T = TypeVar("T", float, Array)


class FilmLoads(NamedTuple):
    """Loads of the film at each point; arrays of one shape.

    viscous: c = k eta v (Pa m), so that tau = c / h; speed: v (m/s); squeeze_rate: K3 (1/(m2 s));
    free_height: H_V (m). With `variable_viscosity` eta depends on the film's temperature, and these
    use its reference eta_0. With a `limit` tau is at most the dry shear strength.
    """

    viscous: Array
    speed: Array
    squeeze_rate: Array
    free_height: Array
    variable_viscosity: VariableViscosity | None = None
    limit: LimitingShear | None = None

    def take(self, index: Index) -> FilmLoads:
        """The loads at `index`."""
        variable_viscosity = self.variable_viscosity and self.variable_viscosity.take(index)
        limit = self.limit and self.limit.take(index)
        viscous, speed, squeeze, free = (part.take(index, mode="clip") for part in self[:4])
        return FilmLoads(viscous, speed, squeeze, free, variable_viscosity, limit)

    def completed(self, covered: Mask, other: FilmLoads) -> FilmLoads:
        """Loads at one end of a step; uncovered places have speed and H_V of the `other` end."""
        return self._replace(
            speed=np.where(covered, self.speed, other.speed),
            free_height=np.where(covered, self.free_height, other.free_height),
        )

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> FilmLoads:
        """These loads: they do not depend on the history."""
        return self

    def of(self, state: FilmHistory) -> FilmLoads:
        """These loads: they do not depend on the state."""
        return self

    def at(self, end: FilmLoads, fraction: float) -> FilmLoads:
        """Loads at `fraction` of a step that ends with `end`, by linear interpolation."""
        return interpolate(self, end, fraction)

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None = None,
        close: float = CLOSE,
    ) -> FilmOnIce:
        """The film in a `stage` of `dt` (s) from `start`, in a step that starts at `before`.

        Squeezed-out water stays outside, even if a rising pressure lowers H_V.
        """
        free = np.maximum(self.free_height, before.squeezed_height)
        loads = self._replace(free_height=free)
        history = start.log_height, start.squeezed_height, dt, loads, start.internal
        law = stage if self.limit is None else partial(limited_stage, self.limit)
        return FilmOnIce(partial(law, near=near, close=close), *history)

    def height(self, log_height: Array) -> Array:
        """h (m) from ln h, or from ln(h + s) with a limit."""
        return np.exp(log_height) if self.limit is None else self.limit.height(log_height)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables after the `stage`, which were `before` at its start."""
        return stage.internal if len(before) else before

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of films in `state`, independent of the ice."""
        return np.asarray(self.viscous * np.exp(self.log_shearing(state)))

    def force(self, step: Step) -> Array:
        """Magnitude of tau (Pa) at the end of the `step`, (n,)."""
        return np.asarray(np.abs(self.viscous) * np.exp(log_shearing(step.state)))

    def log_shearing(self, state: FilmHistory) -> Array:
        """ln(tau / c), (n,), of films in `state` at these slip speeds."""
        if self.limit is None:
            return log_shearing(state)
        return self.limit.log_shearing(state, self.speed)

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear in the `other` state to the shear in `state`."""
        return self.log_shearing(other) - self.log_shearing(state)

    def local_error(self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array) -> Array:
        """Relative local errors (n,) of a step that ends here; `scale` of temperatures, K."""
        return error_norms(step, ice, self.free_height, self.temperature_scale(step, scale), rubber)

    def water_scale(self, step: Step) -> Array:
        """H_V (m), (n,), the reference of errors of H_s."""
        return self.free_height

    def temperature_scale(self, step: Step, scale: Array) -> Array:
        """Reference of temperature errors (K): `scale`, or less where tau depends on
        temperature.
        """
        if self.limit is None:
            return scale
        scale = np.minimum(scale, self.limit.temperature_scale(step.last, self.speed))
        # Water that may freeze holds the surface at T_m from the start of contact.
        return np.where(step.last.melting, np.inf, scale) if self.limit.freezes else scale


def squeeze_rate(pressure: T, D: T, viscosity: Any = WATER_VISCOSITY) -> T:
    """K3 = 8 p / (3 eta D^2), 1/(m2 s): squeeze-out alone is dh/dt = -K3 h^3, (6.5)."""
    result: T = 8.0 * pressure / (3.0 * viscosity * D**2)
    return result


def film_loads(
    pressure: Array,
    speed: Array,
    k: Array,
    D: Array,
    H_V: Array,
    viscosity: Array | float = WATER_VISCOSITY,
    variable_viscosity: VariableViscosity | None = None,
    limit: LimitingShear | None = None,
) -> FilmLoads:
    """Loads at `pressure` (Pa) and `speed` (m/s) for contact parameters k, D (m), H_V (m).

    c = k eta v of (5.29), eta the `viscosity` (Pa s), with `variable_viscosity` its reference; no
    squeeze-out where p <= 0.
    """
    K3 = squeeze_rate(np.maximum(pressure, 0.0), D, viscosity)
    return FilmLoads(k * viscosity * speed, speed, K3, H_V, variable_viscosity, limit)


def interpolate(start: FilmLoads, end: FilmLoads, fraction: float) -> FilmLoads:
    """Loads at `fraction` of a step, interpolated linearly between its ends."""
    if start is end:
        return start
    ends = zip(start[:4], end[:4], strict=True)
    viscous, speed, squeeze, free = (a + fraction * (b - a) for a, b in ends)
    return FilmLoads(viscous, speed, squeeze, free, end.variable_viscosity, end.limit)


class FilmOnIce(NamedTuple):
    """A film below insulated rubber in one stage, with its start values and loads.

    law: `implicit_stage` or `explicit_stage`. The other fields are its arguments, and the internal
    variables at the start.
    """

    law: Callable[..., FilmStage]
    log_height: Array
    squeezed_height: Array
    dt: Array | float
    loads: FilmLoads
    internal: Array = np.zeros((0, 1))

    def height(self, log_height: Array) -> Array:
        """h (m) from the height variable of the stage."""
        return self.loads.height(log_height)

    @property
    def power_at_start(self) -> Array:
        """q_f (W/m2) of the film at the start of the stage."""
        return np.asarray(self.loads.viscous * self.loads.speed * np.exp(log_shearing(self)))

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """The stage above `ice`, with the viscosity at its end; `near` is not needed."""
        loads, variable_viscosity = self.loads, self.loads.variable_viscosity
        if variable_viscosity is None:
            return self.law(self.log_height, self.squeezed_height, self.dt, loads, ice)

        def stage(log_viscosity: Array) -> tuple[Array, FilmStage]:
            """Temperature and stage of films of ln(eta / eta_0)."""
            viscosity = np.exp(log_viscosity)
            acting = loads._replace(
                viscous=viscosity * loads.viscous, squeeze_rate=loads.squeeze_rate / viscosity
            )
            found = self.law(self.log_height, self.squeezed_height, self.dt, acting, ice)
            warm = ice.offset + ice.resistance * found.friction_power
            return np.minimum(warm, ice.solid.melting_temperature), found

        log_viscosity, temperature, found = consistent_viscosity(
            stage, variable_viscosity, self.internal[0]
        )
        # Without melting, warmer ice lowers the friction power.
        less = ice.resistance * found.friction_power * variable_viscosity.fall(temperature)
        return found._replace(
            ice_slope=np.where(found.melting, found.ice_slope, less / (1.0 + less)),
            internal=log_viscosity[None],
            shearing=np.exp(log_viscosity) * found.shearing,
        )
