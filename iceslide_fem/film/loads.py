"""Loads of water films, and a film in one implicit stage.

    viscous coefficient   c = k eta v, so that tau = c / h        (5.29)
    squeeze rate          K3 = 8 p / (3 eta D^2)                  (6.5)

Equation numbers are those of R. Leonardi's thesis. The film law is made of components: contact (k,
D, H_V), shear (viscous, or limited by a strength), voids (squeeze-out stops, or they carry), phase
change (melts, freezes), a viscosity over temperature, and hysteresis on rough ice. A law that has
other components than the published one has internal variables of its films, in this order:

    ln(eta (h + s) / (eta_0 (h + h_b)))    s and h_b as in `limiting_shear`, 0 without a limit
    tau_b                                  with a limit
    ln(eta / eta_0)                        with a viscosity over temperature
    1 on melting ice, else 0               with voids that carry
    B                                      with them: length of the lug above, m
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

from iceslide_fem.film.carrying import Carried, Sharing
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.hysteresis import Rough
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.in_stage import FilmOnIce
from iceslide_fem.film.integrators import EVEN, InterfaceState, Step, Weights, error_norms
from iceslide_fem.film.law import FilmHistory, FilmStage, log_shearing
from iceslide_fem.film.limited_stage import freezing_stage, limited_stage
from iceslide_fem.film.limiting_shear import LimitingShear, film_height
from iceslide_fem.film.phase import Phase, Refreeze
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.materials import WATER_VISCOSITY

MOLTEN, LUG = -2, -1  # numbers of internal variables
T = TypeVar("T", float, Array)


class FilmLoads(NamedTuple):
    """Loads of the film at each point; arrays of one shape.

    viscous: c = k eta v (Pa m), so that tau = c / h; speed: v (m/s); squeeze_rate: K3 (1/(m2 s));
    free_height: H_V (m). The other fields are components of the law, None if it does not have them.

    variable_viscosity: eta depends on the film's temperature, and the arrays use its reference
    eta_0; limit: tau is at most the dry shear strength; carried: full voids bear load; refreeze,
    phase: which water freezes (`film.phase`), phase that of a stage; rough: hysteresis on rough
    ice, which adds to tau.
    """

    viscous: Array
    speed: Array
    squeeze_rate: Array
    free_height: Array
    variable_viscosity: VariableViscosity | None = None
    limit: LimitingShear | None = None
    carried: Carried | None = None
    refreeze: Refreeze = "nothing"
    phase: Phase | None = None
    rough: Rough | None = None

    @property
    def alone(self) -> bool:
        """Whether a stage has no other unknown than the film's height and strength."""
        return self.variable_viscosity is None and self.carried is None

    def take(self, index: Index) -> FilmLoads:
        """The loads at `index`."""
        viscous, speed, squeeze, free = (part.take(index, mode="clip") for part in self[:4])
        return FilmLoads(
            viscous,
            speed,
            squeeze,
            free,
            self.variable_viscosity and self.variable_viscosity.take(index),
            self.limit and self.limit.take(index),
            self.carried and self.carried.take(index),
            self.refreeze,
            rough=self.rough and self.rough.take(index),
        )

    def completed(self, covered: Mask, other: FilmLoads) -> FilmLoads:
        """Loads at one end of a step; uncovered places have speed, H_V and the pressure on voids of
        the `other` end.
        """
        carried = self.carried
        if carried is not None and other.carried is not None:
            carried = carried.completed(covered, other.carried)
        return self._replace(
            speed=np.where(covered, self.speed, other.speed),
            free_height=np.where(covered, self.free_height, other.free_height),
            carried=carried,
        )

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> FilmLoads:
        """These loads, with voids below the lugs in `state`, and where its water holds T_m."""
        carried = self.carried
        if carried is None:
            return self
        if len(state.internal):
            carried = carried.below(state.internal[LUG])
        if self.refreeze == "area":
            carried = carried.begun(state.squeezed_height, state.internal[MOLTEN] > 0.5)
        return self._replace(carried=carried)

    def at(self, end: FilmLoads, fraction: float) -> FilmLoads:
        """Loads at `fraction` of a step that ends with `end`, by linear interpolation."""
        if self is end:
            return self
        ends = zip(self[:4], end[:4], strict=True)
        viscous, speed, squeeze, free = (a + fraction * (b - a) for a, b in ends)
        carried = self.carried
        if carried is not None and end.carried is not None:
            carried = carried.at(end.carried, fraction)
        components = end.variable_viscosity, end.limit, carried, end.refreeze
        rough = self.rough and end.rough and self.rough.at(end.rough, fraction)
        return FilmLoads(viscous, speed, squeeze, free, *components, rough=rough)

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
        phase = None
        if self.refreeze in ("film", "all"):
            stored = np.maximum(start.squeezed_height, 0.0) if self.refreeze == "all" else 0.0
            phase = Phase(stored)
        free = np.maximum(self.free_height, before.squeezed_height)
        loads = self._replace(free_height=free, phase=phase)
        law: Callable[..., FilmStage] = partial(stage, near=near, close=close)
        if self.limit is not None:
            law = partial(limited_stage, near=near, close=close)
        elif self.refreeze != "nothing":
            law = partial(freezing_stage, near=near, close=close)
        return FilmOnIce(law, start.log_height, start.squeezed_height, dt, loads, start.internal)

    def height(self, log_height: Array) -> Array:
        """h (m) from ln h, or from ln(h + s) with a limit."""
        return film_height(log_height, self.limit)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables after the `stage`, which were `before` at its start."""
        if not len(before):
            return before
        if self.carried is None:
            return stage.internal
        return np.vstack([stage.internal, stage.melting, before[LUG]])

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of films in `state`, independent of the ice."""
        return self.stress_of(np.exp(self.log_shearing(state)), state)

    @property
    def viscosity_row(self) -> int:
        """Number of the internal variable ln(eta / eta_0)."""
        return viscosity_row(self.limit)

    def at_viscosity(self, ratio: Array) -> FilmLoads:
        """The loads with a viscosity of `ratio` times the reference, (n,)."""
        limit, carried = self.limit, self.carried
        return self._replace(
            viscous=ratio * self.viscous,
            squeeze_rate=self.squeeze_rate / ratio,
            limit=limit and limit.at_viscosity(ratio),
            carried=carried and carried._replace(viscosity=carried.viscosity * ratio),
        )

    def growth(self, state: InterfaceState) -> Array | float:
        """Ratio of the film's tau in `state` to that with all pressure on the asperities, (n,)."""
        if self.carried is None:
            return 1.0
        shearing = np.exp(self.log_shearing(state))
        whole = self.viscous * shearing
        now = self._film_stress(shearing, state)
        return np.divide(now, whole, out=np.ones_like(now), where=whole != 0.0)

    def stress(self, stage: FilmStage) -> Array:
        """tau (Pa) at the end of a `stage` under these loads, (n,)."""
        return self.stress_of(stage.shearing, stage)

    def stress_of(self, shearing: Array, end: FilmHistory | FilmStage) -> Array:
        """tau (Pa) of films of the `shearing` (1/m), of water in voids that carry, and of
        hysteresis, (n,).

        end: end of a step or a stage, with the water in the voids.
        """
        film = self._film_stress(shearing, end)
        return film if self.rough is None else film + self.rough.borne(self.share(end))[0]

    def share(self, end: FilmHistory | FilmStage) -> Array | float:
        """p_c / p with the water at the `end` of a step or a stage, (n,)."""
        return 1.0 if self.carried is None else self.carried.share(end.squeezed_height)

    def _film_stress(self, shearing: Array, end: FilmHistory | FilmStage) -> Array:
        if self.carried is None:
            return np.asarray(self.viscous * shearing)
        shared = self.carried.sharing(end.squeezed_height, self.speed)
        thick = shared.thick
        if self.variable_viscosity is not None:
            thick = thick * np.exp(end.internal[self.viscosity_row])
        return np.asarray(self.viscous * shared.viscous * shearing + thick)

    def beside(self, shared: Sharing, phase: Phase | None) -> FilmLoads:
        """The film's loads under a load sharing; phase: what freezes."""
        return self._replace(
            viscous=self.viscous * shared.viscous,
            squeeze_rate=self.squeeze_rate * shared.squeeze,
            free_height=np.full_like(self.viscous, np.inf),
            carried=None,
            phase=phase,
        )

    def bend(self, middle: FilmLoads, end: FilmLoads) -> Array:
        """Relative distance of loads in the `middle` of a step from the line between its ends."""
        line = self.at(end, 0.5)
        gaps = (
            np.abs(getattr(middle, name) - getattr(line, name))
            / np.maximum(np.abs(getattr(end, name)), np.abs(getattr(self, name)) + 1e-300)
            for name in ("viscous", "squeeze_rate")
        )
        bent = np.maximum(*gaps)
        if self.rough is None or middle.rough is None or end.rough is None or line.rough is None:
            return bent
        largest = np.maximum(np.abs(end.rough.shear), np.abs(self.rough.shear) + 1e-300)
        return np.maximum(bent, np.abs(middle.rough.shear - line.rough.shear) / largest)

    def force(self, step: Step) -> Array:
        """Magnitude of tau (Pa) at the end of the `step`, (n,)."""
        return np.abs(self.stress_of(np.exp(log_shearing(step.state)), step.state))

    def log_shearing(self, state: FilmHistory) -> Array:
        """ln(tau / c), (n,), of films in `state` at these slip speeds."""
        if self.limit is None:
            return log_shearing(state)
        if self.variable_viscosity is None:
            return self.limit.log_shearing(state, self.speed)
        ratio = state.internal[self.viscosity_row]
        return ratio + self.limit.at_viscosity(np.exp(ratio)).log_shearing(state, self.speed)

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear in the `other` state to the shear in `state`."""
        if self.carried is None:
            return self.log_shearing(other) - self.log_shearing(state)
        here, there = (self.shear(one, ice) for one in (state, other))
        size = np.maximum(np.abs(here), np.finfo(float).tiny)
        return np.where(here == there, 0.0, (there - here) / size)

    def local_error(
        self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array, weights: Weights = EVEN
    ) -> Array:
        """Relative local errors (n,) of a step that ends here; `scale` of temperatures, K.

        Where water meets cold ice the flux into the ice is infinite at first, so a shorter step has
        no smaller error. The layers of the ice bound it, and the end of an L-stable step is right.
        """
        water, kelvin = self._water_scale(step), self._temperature_scale(step, scale)
        error = error_norms(step, ice, water / weights.water, kelvin, rubber, weights.dry)
        met = self._meets_cold_ice(step, ice) & step.last.melting & np.isfinite(error)
        return np.where(met, 0.0, error)

    def overfreezes(self, step: Step, ice: IceHeat) -> Mask:
        """Where stages of a `step` that ends here freeze more water on cold ice than there is."""
        more = step.state.squeezed_height < step.change.squeezed_height
        return more & self._meets_cold_ice(step, ice) if more.any() else more

    def _meets_cold_ice(self, step: Step, ice: IceHeat) -> Mask:
        """Where water and ice that does not melt are in contact from the start of the `step`."""
        if self.refreeze != "area" or self.carried is None:
            return np.zeros(self.speed.shape, dtype=bool)
        change = step.total
        cold = step.state.internal[MOLTEN] - change.internal[MOLTEN] < 0.5
        warms = ice.surface_temperature(change.ice) > ice.surface_temperature(0.0 * change.ice)
        water = step.state.squeezed_height - change.squeezed_height
        return cold & warms & self.carried.wet(water)

    def _water_scale(self, step: Step) -> Array:
        """Reference of errors of water (m), (n,): H_V, or the larger one of H_V and W."""
        if self.carried is None:
            return self.free_height
        return np.maximum(self.carried.held, step.state.squeezed_height)

    def _temperature_scale(self, step: Step, scale: Array) -> Array:
        """Reference of temperature errors (K): `scale`, or less where tau depends on
        temperature.
        """
        if self.limit is not None:
            scale = np.minimum(scale, self.limit.temperature_scale(step.last, self.speed))
        if self.refreeze == "nothing":
            return scale
        # Water that may freeze holds the surface at T_m from the start of contact.
        return np.where(step.last.melting, np.inf, scale)

    def wet(self, state: FilmHistory) -> Mask:
        """Places where water that may freeze holds the ice's surface at T_m, (n,)."""
        if self.refreeze == "nothing":
            return np.zeros(state.log_height.shape, dtype=bool)
        film = self.height(state.log_height) > 0.0
        if self.carried is None:
            return film | ((self.refreeze == "all") & (state.squeezed_height > 0.0))
        film &= (self.limit is not None) & (self.carried.pressure > 0.0)
        return film | self.carried.wet(state.squeezed_height)


def viscosity_row(limit: LimitingShear | None) -> int:
    """Number of the internal variable ln(eta / eta_0), behind those of a limit."""
    return 1 if limit is None else 2


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
    carried: Carried | None = None,
    refreeze: Refreeze = "nothing",
    rough: Rough | None = None,
) -> FilmLoads:
    """Loads at `pressure` (Pa) and `speed` (m/s) for contact parameters k, D (m), H_V (m).

    c = k eta v of (5.29), eta the `viscosity` (Pa s), with `variable_viscosity` its reference; no
    squeeze-out where p <= 0. The others are components of `FilmLoads`.
    """
    K3 = squeeze_rate(np.maximum(pressure, 0.0), D, viscosity)
    components = variable_viscosity, limit, carried, refreeze
    return FilmLoads(k * viscosity * speed, speed, K3, H_V, *components, rough=rough)
