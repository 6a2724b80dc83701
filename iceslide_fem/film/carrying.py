"""Voids whose water bears a part of the pressure: load sharing, and film and water together.

The film law acts under the contact pressure p_c of `voids`. p_c follows from the water W in the
voids at the end of the stage, so film and W are solved together. Water that bears p_f is also
sheared, as a film of the height W over the fraction p_f / p of the area:

    tau = k(p_c) eta v / h + (p_f / p) eta v / W                           (1)
    dW/dt = K3(p_c) h^3 + m_W - p_f W^3 / (eta B^2)                        (2)

m_W: water that melts and freezes in the voids, by area (`phase`), else 0.

Where ice passes below rubber, water between both moves with a fraction f of the ice's speed,
sheared by Couette's profile with 1/2. Its flux f W over the ice's speed is then what (2) changes,
and the state: a layer on the ice. Deeper water W lies below the rubber. All methods take the state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.law import FilmStage, Surface
from iceslide_fem.film.phase import Phase
from iceslide_fem.film.voids import Voids
from iceslide_fem.runtime.arrays import Array, Index, Mask, some_of

SETTLED, MOST_PASSES = 1e-11, 80  # tolerance of ln W; iterations
LEAST_SLOPE = 0.2  # least slope of the residual of ln W for a secant step
DRIEST = 1e-30  # m, lower bound of water that does not freeze completely
GONE = 1e-12  # of H_V: less water counts as none


class Sharing(NamedTuple):
    """Load sharing; arrays (n,).

    viscous, squeeze: factors on the film's loads at p_c instead of p; borne: p_f, Pa; thick: shear
    of the water that bears it, Pa; k: at p_c; filled: min(1, W / H_V(p_c)).
    """

    viscous: Array
    squeeze: Array
    borne: Array
    thick: Array
    k: Array
    filled: Array


class Whole(NamedTuple):
    """The contact with all pressure on the asperities: p (Pa), k, D (m), H_V (m); arrays (n,)."""

    pressure: Array
    k: Array
    D: Array
    held: Array


# Sharing, water in the voids (m), surface, what freezes -> the film's stage.
FilmOf = Callable[[Sharing, Array, Surface, Phase | None], FilmStage]


class Carried(NamedTuple):
    """Load-bearing voids of places; arrays (n,).

    pressure: over the contact part of a place, Pa; cover: fade-in factor of the shear times the
    contact fraction of the place; viscosity: eta, Pa s; softness: of aged contact, p_e / p; least:
    water that does not count, m (`wet`); at_melting: where water holds the ice's surface at T_m in
    a step; flows: speed of the water over that of the ice, both relative to the rubber, where ice
    passes.
    """

    voids: Voids
    pressure: Array
    cover: Array
    viscosity: Array | float
    softness: Array | float = 1.0
    least: float = 0.0
    at_melting: Mask | None = None
    flows: Array | float = 1.0

    def take(self, index: Index) -> Carried:
        """The voids at `index`."""
        return Carried(
            self.voids.take(index),
            self.pressure[index],
            self.cover[index],
            some_of(self.viscosity, index),
            some_of(self.softness, index),
            self.least,
            flows=some_of(self.flows, index),
        )

    def wet(self, water: Array) -> Mask:
        """Whether `water` (m) below the rubber holds the ice's surface at T_m.

        A film that ice begins with without melting may be squeezed out into the voids. It stands
        for dry contact, and does not count as water.
        """
        return np.asarray((self.pressure > 0.0) & (water > self.least * self.flows))

    def begun(self, water: Array, molten: Mask) -> Carried:
        """The voids in a step that begins with `water` (m), where the ice was `molten` or not."""
        return self._replace(at_melting=molten | self.wet(water))

    def completed(self, covered: Mask, other: Carried) -> Carried:
        """Places that are not `covered` have the pressure and contact of the `other` end."""
        softness = np.where(covered, self.softness, other.softness)
        return self._replace(
            pressure=np.where(covered, self.pressure, other.pressure),
            softness=softness if isinstance(self.softness, np.ndarray) else 1.0,
        )

    def below(self, lug: Array) -> Carried:
        """The voids below lugs of the lengths B (m), (n,)."""
        return self._replace(voids=replace(self.voids, lug=lug))

    def at(self, end: Carried, fraction: float) -> Carried:
        """The voids at `fraction` of a step that ends with `end`, by linear interpolation."""
        return self._replace(
            pressure=self.pressure + fraction * (end.pressure - self.pressure),
            cover=self.cover + fraction * (end.cover - self.cover),
            softness=self.softness + fraction * (end.softness - self.softness),
        )

    @property
    def whole(self) -> Whole:
        """The contact without water that bears load."""
        p = np.maximum(self.pressure, 0.0)
        k, D = self.voids.touching(p * self.softness)
        held = self.voids.held(np.maximum(p * self.softness, np.finfo(float).tiny))
        return Whole(p, k, D, held)

    @property
    def held(self) -> Array:
        """H_V (m) under all of the pressure; that of the least pressure without any."""
        least = self.voids.table.pressure[0]
        return self.flows * self.voids.held(np.maximum(self.pressure * self.softness, least))

    def contact_pressure(self, water: Array) -> Array:
        """p_c (Pa) with `water` (m) in the voids."""
        p = np.maximum(self.pressure, 0.0)
        return np.minimum(p, self.voids.carried(water / self.flows) / self.softness)

    def share(self, water: Array) -> Array:
        """p_c / p with `water` (m) in the voids; 1 without pressure."""
        p = np.maximum(self.pressure, 0.0)
        solid = self.contact_pressure(water)
        return np.divide(solid, p, out=np.ones_like(p), where=p > 0.0)

    def sharing(self, water: Array, speed: Array, whole: Whole | None = None) -> Sharing:
        """Load sharing with `water` (m) in the voids, at a slip `speed` (m/s).

        whole: that of these voids, if it is known.
        """
        p, whole_k, whole_D, held = whole or self.whole
        depth, solid = water / self.flows, self.contact_pressure(water)
        k, D = self.voids.contact(solid * self.softness)
        share = np.divide(solid, p, out=np.ones_like(p), where=p > 0.0)
        shear = self.viscosity * speed * (1.0 - share) * self.cover
        thick = np.divide(shear, depth, out=np.zeros_like(p), where=share < 1.0)
        filled = np.minimum(np.maximum(depth, 0.0) / held, 1.0)
        squeeze = share * (whole_D / D) ** 2
        return Sharing(k / whole_k, squeeze, p - solid, thick, k, filled)


class Beside(NamedTuple):
    """Film and voids in a stage of `dt` (s), from `water` (m) in the voids.

    speed: of slip, m/s; by_area: whether water freezes by area (`phase`); films_freeze: whether
    films then also freeze without other water; film_of: the film's stage under a load sharing.
    """

    carried: Carried
    speed: Array
    by_area: bool
    films_freeze: bool
    water: Array
    dt: Array | float
    film_of: FilmOf

    def solve(self, ice: Surface) -> FilmStage:
        """Film and voids above `ice`. The water W is a fixed point of the stage.

        The water left in the voids depends weakly on the assumed W, or falls with it. The fixed
        point is therefore unique. It is bracketed by values of W with more and with less water
        left. Where nothing is left without water in the voids, all of it freezes.
        """
        whole = self.carried.whole
        held = self.carried.flows * whole.held
        low = np.full_like(held, DRIEST) if self.by_area else held
        water = np.maximum(self.water, DRIEST) if self.by_area else np.minimum(self.water, held)
        found, left = self._with(water, ice, whole)
        least = GONE * self.carried.held if self.by_area else held
        moves = left > least
        if not self.by_area:
            if not moves.any():
                return found._replace(squeezed_height=left)  # not full: it bears nothing
            water = np.where(moves, np.maximum(self.water, held), left)
            found, left = self._with(water, ice, whole)
        elif not moves.all():
            water = np.where(moves, left, 0.0)
            found, left = self._with(water, ice, whole)
            moves |= left > least
        high = np.full_like(held, np.inf)
        before, residual_before = np.full_like(water, np.nan), np.full_like(water, np.nan)
        for _ in range(MOST_PASSES):
            with np.errstate(divide="ignore"):
                residual = np.log(np.divide(water, left, out=np.ones_like(water), where=moves))
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
            water = np.where(moves, following, water)
            found, left = self._with(water, ice, whole)
        water = np.where(np.abs(residual) > 1e3 * SETTLED, np.nan, left)
        return found._replace(
            squeezed_height=water, log_height=np.where(np.isnan(water), np.nan, found.log_height)
        )

    def _with(self, water: Array, ice: Surface, whole: Whole) -> tuple[FilmStage, Array]:
        """The stage with the load sharing of `water` (m), and the water left in the voids (m)."""
        carried, shared = self.carried, self.carried.sharing(water, self.speed, whole)
        warms = shared.thick * self.speed
        depth = water / carried.flows
        out = carried.voids.outflow(shared.borne, depth, carried.viscosity) / carried.flows
        wet, phase, left = np.zeros(warms.shape, dtype=bool), None, self.water
        last, gives = wet, warms
        if self.by_area:
            assert carried.at_melting is not None
            # On open ice the last water freezes in a stage: its latent heat is all that it gives.
            gives = ice.solid.melting_enthalpy * np.maximum(self.water, 0.0) / self.dt
            last = carried.at_melting & (carried.pressure <= 0.0) & (gives <= ice.melted_flux)
            # A film without strength cannot freeze where nothing slides: its water feeds the ice.
            slides = (self.speed != 0.0) | self.films_freeze
            wet = carried.at_melting & ~last & (slides | (water > 0.0))
            of_films = np.where(slides, 1.0 - (1.0 - shared.k) * shared.filled, 0.0)
            share = np.where(wet, np.minimum(carried.cover, 1.0) * of_films, 1.0)
            freezes = Phase(share=share).of_voids(ice) - np.where(wet, warms, 0.0)
            left = np.maximum(left - self.dt / ice.solid.melting_enthalpy * freezes, 0.0)
            left = np.where(last, 0.0, left)
            phase = Phase(np.where(wet, left, 0.0), share, wet | self.films_freeze)
        into_ice = np.where(last, gives, np.where(wet, 0.0, warms))
        above = ice._replace(
            offset=ice.offset + ice.resistance * into_ice, melted_flux=ice.melted_flux - into_ice
        )
        found = self.film_of(shared, left, above, phase)
        flux = found.ice_flux + into_ice
        after = found.squeezed_height / (1.0 + self.dt * out)  # outflow is implicit
        return found._replace(
            friction_power=found.friction_power + warms,
            ice_flux=flux,
            melt_power=found.friction_power + warms - flux,
            saturated=shared.borne > 0.0,
            outflow=out * after,
        ), after
