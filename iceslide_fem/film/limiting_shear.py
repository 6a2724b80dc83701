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

from iceslide_fem.film.law import FilmHistory, FilmStage
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.shear_strength import ShearStrength

SHEAR_STRENGTH = "shear_strength_Pa"  # the column of tau_b in tables
# Below this slip speed (m/s) dry shear falls to 0 with the speed.
SLOWEST = 1e-6
# Height (m) up to which h_b is added: a film of water hardly begins thinner.
MOST_ADDED = 70e-9
# The same from which on it is added where films freeze: thinner ones, of three molecules or less,
# need not be followed until they are gone.
LEAST_ADDED = 1e-9
# Of the largest strength: strengths that are 0 at T_m.
NO_STRENGTH = 1e-12
# Of s: heights that are none.
ROUNDING = 1e-12


class LimitingShear(NamedTuple):
    """What limits the shear of films: tau_b, the viscosity eta (Pa s) and s (m), a number each or
    one for every point; whether films freeze, and what has been squeezed out of them, too.
    """

    strength: ShearStrength
    viscosity: Array | float
    added: Array | float
    freezes: bool = False
    voids_freeze: bool = False

    @classmethod
    def of(
        cls,
        strength: ShearStrength,
        viscosity: Array | float,
        speed: Array | float,
        refreeze: str = "nothing",
    ) -> LimitingShear:
        """With s = h_b at the melting point and at a `speed` (m/s), but at most `MOST_ADDED`.

        refreeze: "nothing", "film" or "all".
        """
        with np.errstate(divide="ignore"):
            thickness = viscosity * np.maximum(speed, SLOWEST) / strength.strength[0]
        added = np.minimum(thickness, MOST_ADDED)
        if refreeze != "nothing":
            added = np.maximum(added, LEAST_ADDED)
        number = added if added.size > 1 else float(added[0])
        return cls(strength, viscosity, number, refreeze != "nothing", refreeze == "all")

    @classmethod
    def together(cls, limits: Sequence[LimitingShear], sizes: Sequence[int]) -> LimitingShear:
        """Those of all points, so many in each, which freeze alike and have as many rows."""
        numbers = (
            np.concatenate([np.full(n, value) for value, n in zip(values, sizes, strict=True)])
            for values in zip(*(limit[1:3] for limit in limits), strict=True)
        )
        strength = ShearStrength.together([limit.strength for limit in limits], sizes)
        viscosity, added = numbers
        return cls(strength, viscosity, added, limits[0].freezes, limits[0].voids_freeze)

    def take(self, index: Index) -> LimitingShear:
        """The same at the points of `index`."""

        def of_points(part: Array | float) -> Array | float:
            return part.take(index, mode="clip") if isinstance(part, np.ndarray) else part

        return self._replace(
            strength=self.strength.take(index),
            viscosity=of_points(self.viscosity),
            added=of_points(self.added),
        )

    def drag(self, speed: Array) -> Array:
        """eta v (Pa m) at slip speeds (m/s), (n,); that of `SLOWEST` below it."""
        return np.asarray(self.viscosity * np.maximum(np.abs(speed), SLOWEST))

    def height(self, log_height: Array) -> Array:
        """h (m) of y = ln(h + s), 0 where that is rounding."""
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
        return self.kept(height, shearing(height, strength, self.drag(speed)), strength)

    def kept(self, height: Array, shearing: Array, strength: Array) -> Array:
        """The same of films that shear by 1 / (h + h_b) (1/m)."""
        return np.stack([np.log((height + self.added) * shearing), strength])


def shearing(height: Array, strength: Array, drag: Array) -> Array:
    """1 / (h + h_b) (1/m) of films of the height h (m), tau_b (Pa) and eta v (Pa m)."""
    return strength / (height * strength + drag)


class Strengths(NamedTuple):
    """tau_b (Pa) of points that do not melt, d tau_b / d u (Pa/K) there, and their flux (W/m2)."""

    strength: Array
    slope: Array
    flux: Array


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
