"""A limiting shear stress: the shear of a film is at most that of dry rubber on ice.

The real contact (fraction k) of dry rubber and ice has a shear strength tau_b, which falls with the
ice's surface temperature. A water film shears viscously. Both are in series (S. Bair and W. O.
Winer, J. Lubr. Technol. 101 (1979) 251):

    tau = k / (1 / tau_b(T_i) + h / (eta v)) = k eta v / (h + h_b),   h_b = eta v / tau_b(T_i)

All else is the film law (`film.law`). With heat in the rubber T_i is the film's temperature.

A film may have zero height before melting. The unknown is therefore y = ln(h + s), with a constant
height s (`added`) of the order of h_b. Films have two internal variables: ln((h + s) / (h + h_b)),
so that `film.law.log_shearing` is -ln(h + h_b), and tau_b.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.law import FilmHistory, FilmStage
from iceslide_fem.film.shear_strength import SLOWEST, ShearStrength
from iceslide_fem.film.strength_over_speed import Balanced, RatedStrength, SpeedLaw, at_speed
from iceslide_fem.runtime.arrays import Array, Index, Mask, some_of

SHEAR_STRENGTH = "shear_strength_Pa"  # column of tau_b in tables
# Upper bound of s (m): a water film hardly starts thinner.
MOST_ADDED = 70e-9
# Lower bound of s (m) where films freeze: films of three molecules or less need not be resolved.
LEAST_ADDED = 1e-9
# Fraction of the largest strength that replaces a strength of 0 at T_m.
NO_STRENGTH = 1e-12
# Fraction of s below which a height counts as 0.
ROUNDING = 1e-12


class LimitingShear(NamedTuple):
    """Limit of the shear of films.

    It has tau_b, the viscosity eta (Pa s) and s (m), scalars or one per point; rate: how tau_b
    depends on the slip speed, or None.
    """

    strength: ShearStrength
    viscosity: Array | float
    added: Array | float
    rate: SpeedLaw | None = None

    @classmethod
    def of(
        cls,
        strength: ShearStrength,
        viscosity: Array | float,
        speed: Array | float,
        freezes: bool = False,
        rate: SpeedLaw | None = None,
    ) -> LimitingShear:
        """The limit with s = h_b at the melting point and at a `speed` (m/s), at most `MOST_ADDED`.

        freezes: whether films freeze; rate: as of the limit.
        """
        with np.errstate(divide="ignore"):
            thickness = viscosity * np.maximum(speed, SLOWEST) / strength.strength[0]
        added = np.minimum(thickness, MOST_ADDED)
        if freezes:
            added = np.maximum(added, LEAST_ADDED)
        number = added if added.size > 1 else float(added[0])
        return cls(strength, viscosity, number, rate)

    @classmethod
    def together(cls, limits: Sequence[LimitingShear], sizes: Sequence[int]) -> LimitingShear:
        """One limit for the points of several, with equally many rows."""
        numbers = (
            np.concatenate([np.full(n, value) for value, n in zip(values, sizes, strict=True)])
            for values in zip(*(limit[1:3] for limit in limits), strict=True)
        )
        strength = ShearStrength.together([limit.strength for limit in limits], sizes)
        viscosity, added = numbers
        return cls(strength, viscosity, added, limits[0].rate)

    def at_viscosity(self, ratio: Array) -> LimitingShear:
        """The limit with a viscosity of `ratio` times this one, (n,)."""
        return self._replace(viscosity=self.viscosity * ratio)

    def take(self, index: Index) -> LimitingShear:
        """The same at the points of `index`."""
        return self._replace(
            strength=self.strength.take(index),
            viscosity=some_of(self.viscosity, index),
            added=some_of(self.added, index),
        )

    def at_slip(self, speed: Array) -> ShearStrength | RatedStrength:
        """tau_b over temperature at slip speeds (m/s), (n,)."""
        return at_speed(self.strength, self.rate, speed)

    def drag(self, speed: Array) -> Array:
        """eta v (Pa m) at slip speeds (m/s), (n,); at least that of `SLOWEST`."""
        return np.asarray(self.viscosity * np.maximum(np.abs(speed), SLOWEST))

    def height(self, log_height: Array) -> Array:
        """h (m) of y = ln(h + s); rounded to 0 where it is tiny."""
        height = np.exp(log_height) - self.added
        return np.where(height <= ROUNDING * self.added, 0.0, height)

    def log_height(self, height: Array) -> Array:
        """y = ln(h + s) of films of the height (m)."""
        return np.asarray(np.log(height + self.added))

    def log_shearing(self, state: FilmHistory, speed: Array) -> Array:
        """-ln(h + h_b) of films in `state` at slip speeds (m/s), (n,)."""
        height = self.height(state.log_height)
        return np.log(shearing(height, state.internal[1], self.drag(speed)))

    def temperature_scale(self, stage: FilmStage, speed: Array) -> Array:
        """Temperature change (K) that changes tau by 100 %; infinite at melting points."""
        strength = stage.internal[1]
        drag = self.drag(speed)
        dry = drag / (self.height(stage.log_height) * strength + drag)
        if self.rate is None:
            slope = self.strength.slope((self.strength.strength <= strength).sum(axis=0) - 1)
        else:
            slope = np.abs(self.at_slip(speed).slope_at(self.rate.melting - stage.dry_temperature))
        relative = np.where(stage.melting, 0.0, dry * slope / strength)
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / relative)

    def internal(self, height: Array, speed: Array, strength: Array) -> Array:
        """Internal variables (2, n) of films of height h (m) at slip speeds (m/s) and tau_b
        (Pa).
        """
        return self.kept(height, shearing(height, strength, self.drag(speed)), strength)

    def kept(self, height: Array, shearing: Array, strength: Array) -> Array:
        """Internal variables (2, n) of films with the `shearing` 1 / (h + h_b) (1/m)."""
        return np.stack([np.log((height + self.added) * shearing), strength])


def film_height(log_height: Array, limit: LimitingShear | None) -> Array:
    """h (m) from the height variable: ln h, or ln(h + s) with a `limit`."""
    return np.exp(log_height) if limit is None else limit.height(log_height)


def shearing(height: Array, strength: Array, drag: Array) -> Array:
    """1 / (h + h_b) (1/m) of films of the height h (m), tau_b (Pa) and eta v (Pa m)."""
    return strength / (height * strength + drag)


def balanced(
    strength: ShearStrength | RatedStrength,
    undercooling: Array,
    resistance: Array,
    power: Array,
    height: Array,
    drag: Array,
) -> Balanced:
    """tau_b at the temperature caused by friction, where the ice does not melt, (n,).

    With u = T_m - T of the surface, the `undercooling` u_0 without friction (K), and the flux
    q(tau_b) = c v tau_b / (h tau_b + eta v),

        u = u_0 - R q(tau_b(u))

    The sign of the equation at a row of the table tells on which side the root lies. Between two
    rows tau_b is linear, so the equation is quadratic.

    resistance: R (K m2/W); power: c v (W/m); height: h (m); drag: eta v (Pa m).
    """
    if isinstance(strength, RatedStrength):
        return strength.balanced(undercooling, resistance, power, height, drag)
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
    return Balanced(tau, slope, power * tau / (height * tau + drag))
