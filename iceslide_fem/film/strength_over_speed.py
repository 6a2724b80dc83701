"""Shear strength of dry rubber on ice over slip speed and temperature.

    tau_b(v, T) = tau_b(T) B(x),   x = log10(max(|v|, 1e-6 m/s) a(T) / v_0)           (1)

B is exp(-(x / w)^2) (the form of B. Lorenz and others, J. Chem. Phys. 142 (2015) 194701), or rows
over x, constant outside. a(T) is 1, or the shift of an activation energy or of WLF. B may make
tau_b rise with temperature, and friction then warms the surface the more the warmer it is. An
implicit stage has one root only while

    R d q / d T < 1                                                                 (2)

with the flux q(tau_b) of `limiting_shear` and the ice's resistance R, which goes with the root of
the step. Longer steps have no solution here, so step control shortens them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.shear_strength import SLOWEST, ShearStrength, shear_strength
from iceslide_fem.relaxation.shift import AnyShift, NoShift
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene

SAMPLES = 33  # temperatures between which the balance is searched
STEEPEST = 0.5**0.5  # largest R dq/dT of a step, of (2)
CLOSE, MOST_ITERATIONS = 1e-7, 60  # K
NUDGE = 1e-5  # K, for derivatives


@dataclass(frozen=True)
class SpeedLaw:
    """B of (1); reference: v_0, m/s; width: w; rows: of x and B instead; melting: T_m, K; held:
    speed (m/s) that replaces the slip speed, of an elastic block.
    """

    reference: float
    width: float = np.inf
    rows: tuple[tuple[float, float], ...] = ()
    shift: AnyShift = NoShift()
    melting: float = 273.15
    held: float | None = None

    def __call__(self, speed: ArrayLike, temperature: ArrayLike) -> Array:
        """B at slip speeds (m/s) and temperatures of the surface (K), which broadcast."""
        slip = np.abs(np.asarray(speed if self.held is None else self.held, dtype=float))
        x = np.log10(np.maximum(slip, SLOWEST) * self.shift(temperature) / self.reference)
        if self.rows:
            return np.interp(x, *np.transpose(self.rows))
        return np.asarray(np.exp(-((x / self.width) ** 2)))

    @property
    def largest(self) -> float:
        """Largest B."""
        return max(value for _, value in self.rows) if self.rows else 1.0


def speed_law(scene: Scene) -> SpeedLaw | None:
    """B of a scene; None where the strength does not depend on speed.

    A slice or a block takes the load's speed. Where tau_b falls with speed an elastic body has no
    quasi-static motion.
    """
    film, load = scene.film, scene.load
    if film.dry_speed is None:
        return None
    return SpeedLaw(
        film.dry_speed,
        np.inf if film.dry_width is None else film.dry_width,
        film.dry_rows or (),
        NoShift() if film.dry_shift is None else film.dry_shift.shift,
        scene.ice.melting_temperature,
        None if scene.model == "point" else load.speeds.largest,
    )


class Balanced(NamedTuple):
    """tau_b (Pa) of points that do not melt, d tau_b / d u (Pa/K) there, and their flux (W/m2).

    NaN where a stage is too long for one root, see (2).
    """

    strength: Array
    slope: Array
    flux: Array


class RatedStrength(NamedTuple):
    """tau_b of points that slip at `speed` (m/s, (n,)): `cold` times B of the `law`."""

    cold: ShearStrength
    law: SpeedLaw
    speed: Array

    def __call__(self, depth: Array) -> Array:
        """tau_b (Pa) at u = T_m - T (K), (n,)."""
        return self.cold(depth) * self.law(self.speed, self.law.melting - depth)

    @property
    def softest(self) -> Array:
        """tau_b at the melting point, Pa."""
        return np.asarray(self(np.zeros_like(self.speed)))

    @property
    def hardest(self) -> Array:
        """Upper bound of tau_b, Pa."""
        return self.cold.strength[-1] * self.law.largest

    def slope_at(self, depth: Array) -> Array:
        """d tau_b / d u (Pa/K) at u (K), (n,)."""
        return np.asarray((self(depth + NUDGE) - self(depth)) / NUDGE)

    def balanced(
        self, undercooling: Array, resistance: Array, power: Array, height: Array, drag: Array
    ) -> Balanced:
        """tau_b at the temperature caused by friction, as `limiting_shear.balanced`.

        u = u_0 - R q(tau_b(u)) has one root between u_0 and the u of the largest flux. Where it is
        below 0 the ice melts, and the result does not count.
        """

        def flux(tau: Array) -> Array:
            return np.asarray(power * tau / (height * tau + drag))

        def left(depth: Array) -> Array:
            return np.asarray(depth - undercooling + resistance * flux(self(depth)))

        n = self.speed.size
        lowest = undercooling - resistance * flux(np.broadcast_to(self.hardest, (n,)))
        lowest = np.maximum(lowest, np.minimum(undercooling, 0.0))
        parts = np.linspace(0.0, 1.0, SAMPLES)
        depths = lowest + parts[:, None] * (undercooling - lowest)
        tau = self.cold.at_depths(depths) * self.law(self.speed, self.law.melting - depths)
        values = depths - undercooling + resistance * flux(tau)
        # d left / d u = 1 - R dq/dT between the samples.
        run = np.diff(depths, axis=0)
        rise = np.divide(np.diff(values, axis=0), run, out=np.ones_like(run), where=run > 0.0)
        row = np.clip((values <= 0.0).sum(axis=0) - 1, 0, SAMPLES - 2)
        low, high, below, above = (
            np.take_along_axis(part, (row + i)[None], axis=0)[0]
            for part in (depths, values)
            for i in (0, 1)
        )
        depth = low
        for _ in range(MOST_ITERATIONS):
            # Regula falsi with Illinois's halving of the side that stays.
            with np.errstate(divide="ignore", invalid="ignore"):
                following = np.clip(high - above * (high - low) / (above - below), low, high)
            following = np.where(np.isfinite(following), following, low)
            change, depth = np.abs(following - depth), following
            if (change <= CLOSE).all():
                break
            value = left(depth)
            under = value <= 0.0
            low, high = np.where(under, depth, low), np.where(under, high, depth)
            below, above = (
                np.where(under, value, 0.5 * below),
                np.where(under, 0.5 * above, value),
            )
        tau = np.where(rise.min(axis=0) >= 1.0 - STEEPEST, self(depth), np.nan)
        return Balanced(tau, self.slope_at(depth), flux(tau))


def at_speed(
    strength: ShearStrength, law: SpeedLaw | None, speed: Array
) -> ShearStrength | RatedStrength:
    """tau_b over temperature at slip speeds (m/s), (n,)."""
    return strength if law is None else RatedStrength(strength, law, speed)


def shearing_height(scene: Scene, speed: float) -> float:
    """h0 + eta v / tau_b (m): height of a water film with the initial shear of the contact.

    speed: slip speed, m/s.
    """
    strength = shear_strength(scene)
    if strength is None:
        return scene.initial_height
    coldness = np.array([scene.ice.melting_temperature - scene.ice.temperature])
    tau_b = at_speed(strength, speed_law(scene), np.array([speed]))
    return scene.initial_height + scene.viscosity * speed / float(tau_b(coldness)[0])
