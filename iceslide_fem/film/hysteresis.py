"""Hysteresis on rough ice as a component of the film law.

    tau = tau of the film + p_c mu_h(v, T_rubber, p_c)                      (1)

mu_h is that of `surfaces.rough_ice` with the rubber's temperature at the start, from a table over v
a_T and pressure. It is made in the rubber, as deep as the waves are long. Its work is an entry of
its own in the energy balance, and warms neither the ice nor the surface of the rubber.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.relaxation.shift import AnyShift
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene import Scene
from iceslide_fem.surfaces.power_spectrum import PowerSpectrum
from iceslide_fem.surfaces.rough_ice import Moduli, Sliding, sliding

if TYPE_CHECKING:  # takes long to import, and only rough ice needs it
    from scipy.interpolate import RectBivariateSpline

PRESSURES = 1e2, 1e9, 5  # Pa: ends of the table, and rows per decade
PER_DECADE = 12  # of v a_T
SLOWEST, NUDGE = 1e-9, 1e-5  # m/s; relative steps of differences
BEYOND = 100.0  # v a_T of the table's ends, beyond the slowest and the fastest arm on any wave


class Rough(NamedTuple):
    """Hysteresis at points with all pressure on the asperities; arrays (n,).

    shear: p mu_h, Pa; power: shear times slip speed, W/m2; exponent: d ln shear / d ln p.
    """

    shear: Array
    power: Array
    exponent: Array

    def take(self, index: Index) -> Rough:
        """The same at `index`."""
        return Rough(*(part.take(index, mode="clip") for part in self))

    def at(self, end: Rough, fraction: float) -> Rough:
        """At `fraction` of a step that ends with `end`, by linear interpolation."""
        return Rough(*(a + fraction * (b - a) for a, b in zip(self, end, strict=True)))

    def borne(self, share: Array | float) -> tuple[Array, Array]:
        """Shear (Pa) and power (W/m2) where asperities bear a `share` p_c / p of the pressure.

        The shear is a power law of the pressure around p.
        """
        less = np.power(share, self.exponent)
        return self.shear * less, self.power * less


@dataclass(frozen=True, eq=False)
class Hysteresis:
    """mu_h on the waves of `ice`; gamma: of `surfaces.rough_ice`; kelvin: temperature of the rubber
    (K), None for that of the ice; own: roughness of the rubber, or None.
    """

    ice: PowerSpectrum
    rubber: Moduli
    shift: AnyShift
    gamma: float
    kelvin: float | None = None
    own: PowerSpectrum | None = None

    def along(self, reduced_speed: ArrayLike, pressure: ArrayLike) -> Sliding:
        """Contact and hysteresis along the waves at v a_T (m/s) and pressures (Pa)."""
        return sliding(self.ice, self.rubber, reduced_speed, pressure, self.gamma, self.own)

    def at(self, pressure: Array, speed: Array, ice: ArrayLike, exact: bool = False) -> Rough:
        """Under pressures (Pa, at most 0 without contact), at slip speeds (m/s), above ice of a
        temperature (K), (n,).

        exact: by the theory instead of its table, which takes as long as some hundred conditions.
        """
        shear = self.exact if exact else self.shear
        tau, by_pressure, _ = shear(pressure, speed, ice)
        exponent = np.divide(by_pressure * pressure, tau, out=np.ones_like(tau), where=tau != 0.0)
        return Rough(tau, tau * speed, exponent)

    def shear(self, pressure: Array, speed: Array, ice: ArrayLike) -> tuple[Array, Array, Array]:
        """p mu_h (Pa), along the slip, and its derivatives with pressure and speed, any shape."""
        p, table = np.maximum(pressure, 0.0), self._table
        kelvin = np.asarray(ice if self.kelvin is None else self.kelvin, dtype=float)
        reduced = np.abs(speed) * self.shift(kelvin)
        low, high = self._speeds[[0, -1]]
        x = np.log(np.clip(reduced, low, high))
        y = np.log(np.clip(p, *PRESSURES[:2]))
        of_table = np.exp(table(x, y, grid=False))
        slower, faster = reduced < low, reduced > high
        # mu_h rises with v where it is slower than all arms, and falls with 1/v where it is faster.
        mu = of_table * np.where(slower, reduced / low, high / np.maximum(reduced, high))
        by_x = np.where(faster, -1.0, table(x, y, dx=1, grid=False))
        by_y = np.where((p > PRESSURES[0]) & (p < PRESSURES[1]), table(x, y, dy=1, grid=False), 0.0)
        sign, size = np.sign(speed), np.maximum(np.abs(speed), np.finfo(float).tiny)
        rate = np.where(slower, of_table / low * self.shift(kelvin), mu * by_x / size)
        return sign * p * mu, sign * mu * (1.0 + by_y) * (p > 0.0), p * rate

    def exact(self, pressure: Array, speed: Array, ice: ArrayLike) -> tuple[Array, Array, Array]:
        """The same by the theory, with derivatives by differences."""
        kelvin = np.asarray(ice if self.kelvin is None else self.kelvin, dtype=float)
        p, v, T = np.broadcast_arrays(np.maximum(pressure, 0.0), speed, kelvin)
        shape, size = p.shape, np.maximum(np.abs(v), SLOWEST)
        asked = np.maximum(p, PRESSURES[0]), size * self.shift(T)
        at = np.stack([asked[1].ravel(), asked[1].ravel(), (1.0 + NUDGE) * asked[1].ravel()])
        under = np.stack([asked[0].ravel(), (1.0 + NUDGE) * asked[0].ravel(), asked[0].ravel()])
        mu = self.along(at.ravel(), under.ravel()).mu
        here, pressed, faster = mu.reshape(3, *shape)
        # Slower than the slowest speed mu_h falls in proportion.
        slow, sign = np.abs(v) / size, np.sign(v)
        by_pressure = here + (pressed - here) / NUDGE * (p > PRESSURES[0])
        rate = np.where(slow < 1.0, here, (faster - here) / NUDGE) / size
        return sign * slow * p * here, sign * slow * by_pressure * (p > 0.0), p * rate

    @cached_property
    def _speeds(self) -> Array:
        """v a_T (m/s) of the table."""
        times, q = self.rubber.times, self.ice.q
        ends = 1.0 / (BEYOND * q[-1] * times.max()), BEYOND / (q[0] * times.min())
        rows = 2 + int(PER_DECADE * np.log10(ends[1] / ends[0]))
        return np.geomspace(*ends, rows)

    @cached_property
    def _table(self) -> RectBivariateSpline:
        """ln mu_h over ln(v a_T) and ln p."""
        from scipy.interpolate import RectBivariateSpline

        first, last, rows = PRESSURES
        pressures = np.geomspace(first, last, 1 + round(rows * np.log10(last / first)))
        mu = [self.along(speed, pressures).mu for speed in self._speeds]
        return RectBivariateSpline(np.log(self._speeds), np.log(pressures), np.log(mu), s=0)


def hysteresis_of(scene: Scene) -> Hysteresis | None:
    """The component of a scene; None on smooth ice."""
    found, relaxation = scene.ice.roughness.spectrum, scene.rubber.relaxation
    if found is None or relaxation is None:
        return None
    instantaneous = 3.0 * scene.mooney_rivlin.shear_modulus
    given = found, instantaneous, relaxation, scene.ice.roughness.gamma
    return _made(*given, scene.rubber.temperature, scene.rubber.roughness.spectrum)


@lru_cache(maxsize=16)
def _made(
    ice: PowerSpectrum,
    instantaneous: float,
    relaxation: Relaxation,
    gamma: float,
    kelvin: float | None,
    own: PowerSpectrum | None,
) -> Hysteresis:
    """The component; runs of a sweep share its table."""
    return Hysteresis(
        ice, Moduli.of(instantaneous, relaxation), relaxation.shift, gamma, kelvin, own
    )
