"""A film under a limiting shear stress, or one that freezes, in one implicit stage.

Where ice melts or water freezes, the surface is at the melting point. tau_b is then that at T_m,
and the height follows from one equation. Elsewhere the height follows from squeeze-out alone, and
tau_b is that at the temperature caused by its friction.

Freezing (`film.phase`): while the friction power q_f is below the flux q that the film feeds, it
freezes,

    dh/dt = -(q - q_f) / (rho L),

until it is gone. Then other water of the place feeds the flux, as far as it lasts. The latent heat
goes into the ice.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.height import CLOSE, Terms, log_height_of
from iceslide_fem.film.law import FilmForcing, FilmStage, Surface
from iceslide_fem.film.limiting_shear import NO_STRENGTH, LimitingShear, balanced, shearing
from iceslide_fem.film.phase import Phase
from iceslide_fem.runtime.arrays import Array, Index, Mask

# Largest height, over s, that may freeze completely in one stage. A thicker film would lose water,
# because ln(h + s) is not linear in h.
THIN = 0.05
FURTHEST = 40.0  # change of ln h in a stage above which none is found


class LimitedHeight(NamedTuple):
    """The equation of y = ln(h + s) in an implicit stage, at every point; arrays (n,).

        y - start + [min(squeezing h^3, room) - max(heating / (h + h_b) - cooling, least)] / (h + s)
        = 0

    h_b (`dry`, m) is that at the melting point. least is 0 where nothing freezes, else minus
    infinity. Without a limit h_b and s (`added`) are 0. The other symbols are those of
    `HeightEquation`.
    """

    start: Array
    squeezing: Array
    room: Array
    heating: Array
    cooling: Array
    dry: Array
    added: Array
    least: Array

    def take(self, index: Index) -> LimitedHeight:
        """The equation at the points of `index`."""
        return LimitedHeight(*(part[index] for part in self))

    def residual(self, y: Array) -> Array:
        """The left side at y."""
        return self.derivatives(y, self.terms(y))[0]

    def slope(self, y: Array) -> Array:
        """Derivative of the left side; negative beyond the height where nothing is left to
        freeze.
        """
        return 1.0 + self._parts(y, self.terms(y))[1]

    def terms(self, y: Array) -> Terms:
        """The terms at y, over h + s."""
        whole = np.exp(y)
        h, inverse = np.maximum(whole - self.added, 0.0), 1.0 / whole
        squeeze_out, filling = self.squeezing * h**3 * inverse, self.room * inverse
        gain = self.heating / (h + self.dry)
        melts = gain - self.cooling > self.least
        return Terms(inverse, squeeze_out, filling, gain, squeeze_out >= filling, melts)

    def derivatives(self, y: Array, terms: Terms) -> tuple[Array, Array, Array]:
        """The residual and its first two derivatives by y, the first at least 0.1."""
        out, slope, curve = self._parts(y, terms)
        return y - self.start + out, np.maximum(1.0 + slope, 0.1), curve

    def change(self, y: Array, terms: Terms) -> Array:
        """Change of y by Halley's method, limited to 2/3 to 2 times Newton's change."""
        residual, slope, curve = self.derivatives(y, terms)
        newton = residual / slope
        return np.asarray(-newton / (1.0 - np.clip(0.5 * curve * newton / slope, -0.5, 0.5)))

    def _parts(self, y: Array, terms: Terms) -> tuple[Array, Array, Array]:
        """Squeeze-out minus melting, over h + s, and its first two derivatives with y."""
        inverse, squeeze_out, filling, gain, full, melts = terms
        whole = 1.0 / inverse
        h = np.maximum(whole - self.added, 0.0)
        wet = h + self.dry
        melted = np.maximum(gain - self.cooling, self.least)
        out = np.minimum(squeeze_out, filling) - melted * inverse
        first = np.where(full, 0.0, 3.0 * self.squeezing * h**2) + melts * gain / wet
        second = np.where(full, 0.0, 6.0 * self.squeezing * h) - 2.0 * melts * gain / wet**2
        slope = first - out
        return out, slope, second * whole - slope


class FreezingLoads(FilmForcing, Protocol):
    """Loads of films, and what freezes."""

    @property
    def phase(self) -> Phase | None:
        """Freezing in this stage; None if nothing freezes."""


class Water(NamedTuple):
    """Films at the end of a stage: y = ln(h + s), mask of frozen films, freezing power (W/m2)."""

    log_height: Array
    gone: Mask
    given: Array


def limited_stage(
    limit: LimitingShear,
    log_height: Array,
    squeezed: Array,
    dt: Array | float,
    loads: FreezingLoads,
    ice: Surface,
    near: Array | None = None,
    close: float = CLOSE,
) -> FilmStage:
    """The film law under a limiting shear stress in one implicit stage, as `implicit_stage`."""
    T_m, R, phase = ice.solid.melting_temperature, ice.resistance, loads.phase
    drag, power = limit.drag(loads.speed), loads.viscous * loads.speed
    tau_b = limit.at_slip(loads.speed)
    least_strength = NO_STRENGTH * tau_b.hardest
    softest = np.maximum(tau_b.softest, least_strength)
    unit = dt / ice.solid.melting_enthalpy
    room = loads.free_height - squeezed
    fed = ice.melted_flux if phase is None else phase.of_film(ice)
    least = 0.0 if phase is None else np.where(phase.films, -np.inf, 0.0)
    parts = (
        log_height, dt * loads.squeeze_rate, room, unit * power, unit * fed, drag / softest,
        limit.added, least,
    )  # fmt: skip
    equation = LimitedHeight(*(np.broadcast_to(part, log_height.shape) for part in parts))
    y, gone, given = _water(equation, unit, phase, near, close)
    h = limit.height(y)
    molten = power * softest / (h * softest + drag)
    available, other = np.zeros_like(y), np.zeros_like(y)
    at_melting = molten > ice.melted_flux
    if phase is not None:
        stored = phase.stored / unit
        other = np.where(gone, np.clip(fed - molten - given, 0.0, stored), 0.0)
        at_melting |= phase.films & (~gone | (other < stored))
        available = np.where(phase.films, limit.height(log_height) / unit + stored, 0.0)
    given = given + other
    cold = T_m - ice.offset - R * given, R, power, h, drag
    found = balanced(tau_b, *cold)
    strength = np.where(at_melting, softest, np.maximum(found.strength, least_strength))
    q_f = np.where(at_melting, molten, found.flux)
    q_ice = np.where(at_melting, ice.melted_flux, np.minimum(q_f + given, ice.melted_flux))
    q_melt = q_f - q_ice
    # Slope of the friction power of points at T_m, as if they could be warmer.
    slope = np.where(at_melting, tau_b.slope_at(np.zeros_like(h)), found.slope)
    less = R * power * drag * slope / (h * strength + drag) ** 2
    unmolten = q_f * (1.0 + unit * np.maximum(q_melt, 0.0) / (h + drag / strength))
    unmolten += np.where(q_melt < 0.0, available, 0.0)
    free = T_m + R * (unmolten - ice.melted_flux) / (1.0 + less)
    flow = dt * loads.squeeze_rate * h**3
    stays = squeezed + np.minimum(flow, room)
    if phase is not None and isinstance(phase.stored, np.ndarray):
        # Start values may be below 0 by rounding.
        stays = np.maximum(stays - unit * other, 0.0)
    sheared = shearing(h, strength, drag)
    return FilmStage(
        y,
        stays,
        q_f,
        q_ice,
        q_melt,
        np.where(at_melting, free, ice.offset + R * (q_f + given)),
        at_melting,
        flow > room,
        flow - room,
        np.where(at_melting, 1.0, less / (1.0 + less)),
        np.zeros_like(q_ice),
        limit.kept(h, sheared, strength),
        sheared,
    )


def freezing_stage(
    log_height: Array,
    squeezed: Array,
    dt: Array | float,
    loads: FreezingLoads,
    ice: Surface,
    near: Array | None = None,
    close: float = CLOSE,
) -> FilmStage:
    """The published film law with freezing films in one implicit stage, as `implicit_stage`.

    The heat of shearing grows as a film gets thinner, so a film never freezes completely.
    """
    phase, power = loads.phase, loads.viscous * loads.speed
    assert phase is not None
    unit, room = dt / ice.solid.melting_enthalpy, loads.free_height - squeezed
    least, nothing = np.where(phase.films, -np.inf, 0.0), np.zeros_like(log_height)
    parts = (
        log_height, dt * loads.squeeze_rate, room, unit * power, unit * phase.of_film(ice),
        nothing, nothing, least,
    )  # fmt: skip
    equation = LimitedHeight(*(np.broadcast_to(part, log_height.shape) for part in parts))
    y, _ = log_height_of(equation, near, close)
    found = (y > log_height - FURTHEST) & (
        equation.slope(np.maximum(y, log_height - FURTHEST)) > 0.0
    )
    y = np.where(found, y, np.nan)
    h = np.exp(y)
    q_f = power / h
    melting = np.asarray(phase.films | (q_f > ice.melted_flux))
    q_ice = np.where(melting, ice.melted_flux, np.minimum(q_f, ice.melted_flux))
    q_melt = q_f - q_ice
    unmolten = q_f * (1.0 + unit * np.maximum(q_melt, 0.0) / h)
    unmolten += np.where(q_melt < 0.0, (np.exp(log_height) + phase.stored) / unit, 0.0)
    flow = dt * loads.squeeze_rate * h**3
    return FilmStage(
        y,
        squeezed + np.minimum(flow, room),
        q_f,
        q_ice,
        q_melt,
        ice.offset + ice.resistance * unmolten,
        melting,
        flow > room,
        flow - room,
        melting.astype(float),
        np.zeros_like(q_ice),
        shearing=1.0 / h,
    )


def _water(
    equation: LimitedHeight,
    unit: Array | float,
    phase: Phase | None,
    near: Array | None,
    close: float,
) -> Water:
    """Films at the end of a stage; NaN where freezing is too fast for the stage.

    unit: melted height per power, m3/W.
    """
    nothing = np.zeros(equation.start.shape, dtype=bool)
    if phase is None:
        return Water(log_height_of(equation, near, close)[0], nothing, np.zeros(nothing.shape))
    dry = np.log(equation.added)
    thin = equation.start <= dry + np.log1p(THIN)
    gone = thin & (equation.residual(dry) >= 0.0) & phase.films
    y = dry.copy()
    rest = np.flatnonzero(~gone)
    left = equation.take(rest)
    root, _ = log_height_of(left, None if near is None else near[rest], close)
    wrong = (left.slope(root) <= 0.0) | (root < dry[rest])
    y[rest] = np.where(wrong, np.nan, root)
    given = np.where(gone, np.maximum(equation.start - dry, 0.0) * equation.added / unit, 0.0)
    return Water(y, gone, given)
