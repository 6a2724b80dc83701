"""Films beside voids whose water bears a part of the pressure: loads, and the implicit stage.

The film law acts under the contact pressure p_c of `voids`. p_c follows from the water W in the
voids at the end of the stage, so film and W are solved together. Water that bears p_f is also
sheared, as a film of the height W over the fraction p_f / p of the area:

    tau = k(p_c) eta v / h + (p_f / p) eta v / W
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.integrators import InterfaceState, Step, error_norms
from iceslide_fem.film.law import FilmHistory, FilmStage, Surface
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.rubber_heat import RubberHeat
from iceslide_fem.film.voids import Voids
from iceslide_fem.runtime.arrays import Array, Index, Mask

SETTLED, MOST_PASSES = 1e-11, 80  # tolerance of ln W; iterations
LUG = 1  # index of the internal variable B of `Voids`, m; index 0 is that of the film
LEAST_SLOPE = 0.2  # least slope of the residual of ln W for a secant step


class Sharing(NamedTuple):
    """Load sharing: film loads at p_c, the water pressure p_f (Pa), and its shear (Pa), (n,)."""

    film: FilmLoads
    borne: Array
    thick: Array


class CarryingLoads(NamedTuple):
    """Loads at an end of a step; arrays (n,).

    touching: film loads if the asperities bear all of the pressure; pressure: over the contact part
    of a place, Pa; cover: fade-in factor of the shear times the contact fraction of the place;
    viscosity: eta, Pa s.
    """

    voids: Voids
    touching: FilmLoads
    pressure: Array
    cover: Array
    viscosity: float

    def take(self, index: Index) -> CarryingLoads:
        """The loads at `index`."""
        pressure, cover = self.pressure[index], self.cover[index]
        return self._replace(touching=self.touching.take(index), pressure=pressure, cover=cover)

    def completed(self, covered: Mask, other: CarryingLoads) -> CarryingLoads:
        """As of `FilmLoads`; nodes that are not `covered` have the pressure of the `other`."""
        pressure = np.where(covered, self.pressure, other.pressure)
        touching = self.touching.completed(covered, other.touching)
        return self._replace(touching=touching, pressure=pressure)

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> CarryingLoads:
        """These loads, with the lug length of each place in `state`."""
        if not len(state.internal):
            return self
        return self._replace(voids=replace(self.voids, lug=state.internal[LUG]))

    def at(self, end: CarryingLoads, fraction: float) -> CarryingLoads:
        """Loads at `fraction` of a step that ends with `end`, by linear interpolation."""
        return self._replace(
            touching=self.touching.at(end.touching, fraction),
            pressure=self.pressure + fraction * (end.pressure - self.pressure),
            cover=self.cover + fraction * (end.cover - self.cover),
        )

    def sharing(self, water: Array) -> Sharing:
        """Load sharing with `water` (m) in the voids."""
        p = np.maximum(self.pressure, 0.0)
        solid = self.voids.contact_pressure(p, water)
        k, D = self.voids.contact(solid)
        whole_k, whole_D, _, _ = self.voids.table(p)
        share = np.divide(solid, p, out=np.ones_like(p), where=p > 0.0)
        film = self.touching._replace(
            viscous=self.touching.viscous * (k / whole_k),
            squeeze_rate=self.touching.squeeze_rate * share * (whole_D / D) ** 2,
            free_height=np.full_like(p, np.inf),
        )
        shear = self.viscosity * self.touching.speed * (1.0 - share) * self.cover
        thick = np.divide(shear, water, out=np.zeros_like(p), where=share < 1.0)
        return Sharing(film, p - solid, thick)

    def of(self, state: FilmHistory) -> FilmLoads:
        """The film's loads in `state`."""
        return self.sharing(state.squeezed_height).film

    def tau(self, height: Array, water: Array) -> Array:
        """tau (Pa) of films of the `height` (m) with `water` (m) in the voids, (n,)."""
        film, _, thick = self.sharing(water)
        return np.asarray(film.viscous / height + thick)

    def growth(self, state: FilmHistory) -> Array:
        """Ratio of tau in `state` to tau with all pressure on the asperities, (n,)."""
        height = np.exp(state.log_height)
        whole = self.touching.viscous / height
        now = self.tau(height, state.squeezed_height)
        return np.divide(now, whole, out=np.ones_like(now), where=whole != 0.0)

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None = None,
        close: float = CLOSE,
    ) -> CarryingFilm:
        """The film in a `stage` of `dt` (s) from `start`."""
        law = partial(stage, near=near, close=close)
        return CarryingFilm(law, start.log_height, start.squeezed_height, dt, self)

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """None."""
        return before

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of films in `state`, independent of the ice."""
        return self.tau(np.exp(state.log_height), state.squeezed_height)

    def force(self, step: Step) -> Array:
        """Magnitude of tau (Pa) at the end of the `step`, (n,)."""
        return np.abs(self.tau(np.exp(step.state.log_height), step.state.squeezed_height))

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear in the `other` state to the shear in `state`."""
        here, there = (self.shear(one, ice) for one in (state, other))
        size = np.maximum(np.abs(here), np.finfo(float).tiny)
        return np.where(here == there, 0.0, (there - here) / size)

    def local_error(self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array) -> Array:
        """Relative local errors (n,) of a step that ends here; `scale` of temperatures, K."""
        return error_norms(step, ice, self.water_scale(step), scale, rubber)

    def water_scale(self, step: Step) -> Array:
        """Reference of errors of W: the larger one of H_V and W (m), (n,)."""
        free = self.voids.held(np.maximum(self.pressure, self.voids.table.pressure[0]))
        return np.maximum(free, step.state.squeezed_height)

    def temperature_scale(self, step: Step, scale: Array) -> Array:
        """The `scale` (K) of errors of temperatures."""
        return scale


class CarryingFilm(NamedTuple):
    """A film beside voids in one implicit stage of dt (s) (`film.law.Film`); law: film stage."""

    law: Callable[..., FilmStage]
    log_height: Array
    squeezed_height: Array
    dt: Array | float
    loads: CarryingLoads

    @property
    def power_at_start(self) -> Array:
        """q_f (W/m2) of the film that the stage starts from."""
        shear = self.loads.tau(np.exp(self.log_height), self.squeezed_height)
        return np.asarray(shear * self.loads.touching.speed)

    def height(self, log_height: Array) -> Array:
        """h (m) of what the stage says."""
        return np.exp(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """Film and voids above `ice`. The water W is a fixed point of the stage.

        The water left in the voids depends weakly on the assumed W, or falls with it. The fixed
        point is therefore unique. It is bracketed by values of W with more and with less water
        left.
        """
        pressure = np.maximum(self.loads.pressure, 0.0)
        held = self.loads.voids.held(np.maximum(pressure, np.finfo(float).tiny))
        found, left = self._with(np.minimum(self.squeezed_height, held), ice)
        full = left > held
        if not full.any():
            return found._replace(squeezed_height=left)  # not full: it bears nothing
        low, high = held.copy(), np.full_like(held, np.inf)
        water = np.where(full, np.maximum(self.squeezed_height, held), left)
        before, residual_before = np.full_like(water, np.nan), np.full_like(water, np.nan)
        for _ in range(MOST_PASSES):
            found, left = self._with(water, ice)
            with np.errstate(divide="ignore"):
                residual = np.log(np.divide(water, left, out=np.ones_like(water), where=full))
            if not (np.abs(residual) > SETTLED).any():
                break
            low, high = np.where(residual < 0.0, water, low), np.where(residual > 0.0, water, high)
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = (residual - residual_before) / np.log(water / before)
                following = np.where(slope >= LEAST_SLOPE, water * np.exp(-residual / slope), left)
            outside = ~((following >= low) & (following <= high))
            middle = np.where(np.isfinite(high), np.sqrt(low * high), np.maximum(left, low))
            following = np.where(outside, middle, following)
            before, residual_before = water, residual
            water = np.where(full, following, water)
        water = np.where(np.abs(residual) > 1e3 * SETTLED, np.nan, left)
        return found._replace(
            squeezed_height=water, log_height=np.where(np.isnan(water), np.nan, found.log_height)
        )

    def _with(self, water: Array, ice: Surface) -> tuple[FilmStage, Array]:
        """The stage with the load sharing of `water` (m), and the water left in the voids (m)."""
        loads, borne, thick = self.loads.sharing(water)
        warms = thick * self.loads.touching.speed
        above = ice._replace(
            offset=ice.offset + ice.resistance * warms, melted_flux=ice.melted_flux - warms
        )
        found = self.law(self.log_height, np.zeros_like(water), self.dt, loads, above)
        gained = self.squeezed_height + found.squeezed_height
        out = self.loads.voids.outflow(borne, water, self.loads.viscosity)
        left = gained / (1.0 + self.dt * out)  # outflow is implicit
        return found._replace(
            friction_power=found.friction_power + warms,
            ice_flux=found.ice_flux + warms,
            saturated=borne > 0.0,
            outflow=out * left,
        ), left
