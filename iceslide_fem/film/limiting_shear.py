"""A limiting shear stress: films that are thin or slow shear no harder than dry rubber on ice.

The real contact (fraction k) of dry rubber and ice shears at a strength tau_b that falls as the
surface of the ice gets warmer. A film of water shears viscously. Both are in series (S. Bair and
W. O. Winer, J. Lubr. Technol. 101 (1979) 251):

    tau = k / (1 / tau_b(T_i) + h / (eta v)) = k eta v / (h + h_b),   h_b = eta v / tau_b(T_i)

All else is the film law (`film.law`). With heat in the rubber T_i is the film's temperature.

A film may have no height before anything has melted. Steps take y = ln(h + s) with a height s
(`added`) of the order of h_b, which does not change in time. Films keep two internal variables:
ln((h + s) / (h + h_b)), so that `film.law.log_shearing` is -ln(h + h_b), and tau_b.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.height import CLOSE, Terms, log_height_of
from iceslide_fem.film.law import FilmForcing, FilmHistory, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.shear_strength import ShearStrength

SHEAR_STRENGTH = "shear_strength_Pa"  # the column of tau_b in tables
# Below this slip speed (m/s) dry shear falls to 0 with the speed.
SLOWEST = 1e-6
# Height (m) up to which h_b is added: a film of water hardly begins thinner.
MOST_ADDED = 70e-9
# Of the largest strength: strengths that are 0 at T_m.
NO_STRENGTH = 1e-12


class LimitingShear(NamedTuple):
    """What limits the shear of films: tau_b, the viscosity eta (Pa s) and s (m), a number each or
    one for every point.
    """

    strength: ShearStrength
    viscosity: Array | float
    added: Array | float

    @classmethod
    def of(
        cls, strength: ShearStrength, viscosity: Array | float, speed: Array | float
    ) -> LimitingShear:
        """With s = h_b at the melting point and at a `speed` (m/s), but at most `MOST_ADDED`."""
        with np.errstate(divide="ignore"):
            thickness = viscosity * np.maximum(speed, SLOWEST) / strength.strength[0]
        added = np.minimum(thickness, MOST_ADDED)
        return cls(strength, viscosity, added if added.size > 1 else float(added[0]))

    @classmethod
    def together(cls, limits: Sequence[LimitingShear], sizes: Sequence[int]) -> LimitingShear:
        """Those of all points, so many in each, whose strengths have as many rows."""
        numbers = (
            np.concatenate([np.full(n, value) for value, n in zip(values, sizes, strict=True)])
            for values in zip(*(limit[1:] for limit in limits), strict=True)
        )
        return cls(ShearStrength.together([limit.strength for limit in limits], sizes), *numbers)

    def take(self, index: Index) -> LimitingShear:
        """The same at the points of `index`."""
        numbers = (
            part.take(index, mode="clip")
            if isinstance(part, np.ndarray) and part.size > 1
            else part
            for part in self[1:]
        )
        return LimitingShear(self.strength.take(index), *numbers)

    def drag(self, speed: Array) -> Array:
        """eta v (Pa m) at slip speeds (m/s), (n,); that of `SLOWEST` below it."""
        return np.asarray(self.viscosity * np.maximum(np.abs(speed), SLOWEST))

    def height(self, log_height: Array) -> Array:
        """h (m) of y = ln(h + s)."""
        return np.maximum(np.exp(log_height) - self.added, 0.0)

    def log_height(self, height: Array) -> Array:
        """y = ln(h + s) of films of the height (m)."""
        return np.asarray(np.log(height + self.added))

    def log_shearing(self, state: FilmHistory, speed: Array) -> Array:
        """-ln(h + h_b) of films in `state` at slip speeds (m/s), (n,)."""
        strength = state.internal[1]
        return np.log(strength / (self.height(state.log_height) * strength + self.drag(speed)))

    def temperature_scale(self, stage: FilmStage, speed: Array) -> Array:
        """By how much (K) temperatures change that change tau as a whole; of points that do not
        melt, infinite elsewhere.
        """
        strength = stage.internal[1]
        drag = self.drag(speed)
        dry = drag / (self.height(stage.log_height) * strength + drag)
        row = (self.strength.strength <= strength).sum(axis=0) - 1
        relative = np.where(stage.melting, 0.0, dry * self.strength.slope(row) / strength)
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / relative)

    def internal(self, height: Array, speed: Array, strength: Array) -> Array:
        """Internal variables (2, n) of films of the height h (m) at slip speeds (m/s) and tau_b."""
        drag = self.drag(speed)
        shearing = strength / (height * strength + drag)
        return np.stack([np.log((height + self.added) * shearing), strength])


class LimitedHeight(NamedTuple):
    """The equation of y = ln(h + s) in an implicit stage, at every point; arrays (n,).

        y - start + [min(squeezing h^3, room) - max(heating / (h + h_b) - cooling, 0)] / (h + s) = 0

    h_b (`dry`, m) is that at the melting point; the others are those of `HeightEquation`.
    """

    start: Array
    squeezing: Array
    room: Array
    heating: Array
    cooling: Array
    dry: Array
    added: Array

    def take(self, index: Index) -> LimitedHeight:
        """The equation at the points of `index`."""
        return LimitedHeight(*(part[index] for part in self))

    def residual(self, y: Array) -> Array:
        """The left side at y."""
        return self.derivatives(y, self.terms(y))[0]

    def terms(self, y: Array) -> Terms:
        """The terms at y, over h + s."""
        whole = np.exp(y)
        h, inverse = np.maximum(whole - self.added, 0.0), 1.0 / whole
        squeeze_out, filling = self.squeezing * h**3 * inverse, self.room * inverse
        gain = self.heating / (h + self.dry)
        return Terms(
            inverse, squeeze_out, filling, gain, squeeze_out >= filling, gain > self.cooling
        )

    def derivatives(self, y: Array, terms: Terms) -> tuple[Array, Array, Array]:
        """The residual and its first two derivatives by y, the first at least 0.1."""
        inverse, squeeze_out, filling, gain, full, melts = terms
        whole = 1.0 / inverse
        h = np.maximum(whole - self.added, 0.0)
        wet = h + self.dry
        out = np.minimum(squeeze_out, filling) - np.maximum(gain - self.cooling, 0.0) * inverse
        # d/dh and d2/dh2 of what is squeezed out less what melts
        first = np.where(full, 0.0, 3.0 * self.squeezing * h**2) + melts * gain / wet
        second = np.where(full, 0.0, 6.0 * self.squeezing * h) - 2.0 * melts * gain / wet**2
        slope = first - out
        curve = second * whole - slope
        return y - self.start + out, np.maximum(1.0 + slope, 0.1), curve

    def change(self, y: Array, terms: Terms) -> Array:
        """Change of y by Halley's method, two thirds to twice that of Newton's."""
        residual, slope, curve = self.derivatives(y, terms)
        newton = residual / slope
        return np.asarray(-newton / (1.0 - np.clip(0.5 * curve * newton / slope, -0.5, 0.5)))


class Strengths(NamedTuple):
    """tau_b (Pa) of points that do not melt, d tau_b / d u (Pa/K) there, and their flux (W/m2)."""

    strength: Array
    slope: Array
    flux: Array


def limited_stage(
    limit: LimitingShear,
    log_height: Array,
    squeezed: Array,
    dt: Array | float,
    loads: FilmForcing,
    ice: Surface,
    near: Array | None = None,
    close: float = CLOSE,
) -> FilmStage:
    """The film law under a limiting shear stress in one implicit stage, as `implicit_stage`.

    Where the ice melts tau_b is that at T_m, and the height follows from one equation. Elsewhere
    the height is what squeeze-out leaves, and tau_b is that of the temperature which its own
    friction makes: one root, because friction falls as the surface gets warmer.
    """
    drag, power = limit.drag(loads.speed), loads.viscous * loads.speed
    softest = np.maximum(limit.strength.strength[0], NO_STRENGTH * limit.strength.strength[-1])
    unit = dt / ice.solid.melting_enthalpy
    room = loads.free_height - squeezed
    parts = (
        log_height, dt * loads.squeeze_rate, room, unit * power, unit * ice.melted_flux,
        drag / softest, limit.added,
    )  # fmt: skip
    equation = LimitedHeight(*(np.broadcast_to(part, log_height.shape) for part in parts))
    y, _ = log_height_of(equation, near, close)
    h = limit.height(y)
    molten = power * softest / (h * softest + drag)
    melting = molten > ice.melted_flux
    undercooling = ice.solid.melting_temperature - ice.offset
    found = dry_strength(limit.strength, undercooling, ice.resistance, power, h, drag)
    strength = np.where(melting, softest, np.maximum(found.strength, softest))
    q_f = np.where(melting, molten, found.flux)
    q_ice = np.minimum(q_f, ice.melted_flux)
    q_melt = q_f - q_ice
    # Warmer ice makes less heat: of points that melt that would be so without melting.
    slope = np.where(melting, limit.strength.slope(np.zeros(h.size, dtype=int)), found.slope)
    less = ice.resistance * power * drag * slope / (h * strength + drag) ** 2
    unmolten = q_f * (1.0 + unit * q_melt / (h + drag / strength))
    dry = np.where(
        melting,
        ice.solid.melting_temperature
        + ice.resistance * (unmolten - ice.melted_flux) / (1.0 + less),
        ice.offset + ice.resistance * q_f,
    )
    flow = dt * loads.squeeze_rate * h**3
    shearing = strength / (h * strength + drag)
    return FilmStage(
        y,
        squeezed + np.minimum(flow, room),
        q_f,
        q_ice,
        q_melt,
        dry,
        melting,
        flow > room,
        flow - room,
        np.where(melting, 1.0, less / (1.0 + less)),
        np.zeros_like(q_ice),
        np.stack([np.log((h + limit.added) * shearing), strength]),
        shearing,
    )


def dry_strength(
    strength: ShearStrength,
    undercooling: Array,
    resistance: Array,
    power: Array,
    height: Array,
    drag: Array,
) -> Strengths:
    """tau_b at the temperature that friction itself makes, where the ice does not melt, (n,).

    With u = T_m - T of the surface, `undercooling` u_0 that without friction (K), and the flux
    q(tau_b) = c v tau_b / (h tau_b + eta v),

        u = u_0 - R q(tau_b(u))

    The side of the root on which a row lies is known from the sign there. Between two rows tau_b is
    a line, and the equation one of second degree.

    resistance: R (K m2/W); power: c v (W/m); height: h (m); drag: eta v (Pa m).
    """
    rows = len(strength.depth)
    low, high = np.zeros(height.size, dtype=int), np.full(height.size, rows)

    def above(row: Index) -> Mask:
        """Whether the root lies above a row."""
        tau, u = strength.at(row, strength.strength), strength.at(row, strength.depth)
        warmed = resistance * power * tau / (height * tau + drag)
        return np.asarray(u - undercooling + warmed < 0.0)

    while (high - low > 1).any():
        middle = (low + high) // 2
        here = above(np.minimum(middle, rows - 1))
        low, high = np.where(here, middle, low), np.where(here, high, middle)
    slope = strength.slope(low)
    first = strength.at(low, strength.strength)
    aim = first + slope * (undercooling - strength.at(low, strength.depth))
    linear = drag + slope * resistance * power - aim * height
    root = np.sqrt(np.maximum(linear**2 + 4.0 * height * aim * drag, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        tau = np.where(
            linear >= 0.0, 2.0 * aim * drag / (linear + root), (root - linear) / (2.0 * height)
        )
    tau = np.where(slope > 0.0, np.maximum(tau, first), first)
    return Strengths(tau, slope, power * tau / (height * tau + drag))
