"""Contact of rough rubber with rough ice: what rough ice changes in k, D and H_V.

The rubber's own waves C_r rest in the rubber, and meet its modulus E_r of long contact. Waves of
the ice C meet the modulus <|E|^2> of their frequency. As in `rough_ice`, with h'^2 = 2 pi int q^3 C
dq:

    pressure  s = h'_r E_r / sqrt(h'_r^2 E_r^2 + 2 pi int q^3 C <|E|^2> dq)                     (1)
    width     w = d / d_r,   d^2 = int q^3 [C <|E|^2> + C_r E_r^2] dq / int q^5 [...] dq         (2)
    energy    U = pi/2 int q^2 P S(P) [C sqrt(<|E|^2>) + C_r E_r] dq / (1 - nu^2)                (3)
    mean gap  u = int_p^inf (dU/dp') / p' dp'                                                   (4)

P depends on the pressure over the rms of slope times modulus. So contact with rough ice is contact
with smooth ice at the pressure s p: k(p) = k_smooth(s p). The width of contact patches follows rms
slope over rms curvature: D(p) = w D_smooth(s p). (4): the pressure does the work that U stores, p
du = -dU (B. N. J. Persson, Phys. Rev. Lett. 99 (2007) 125502). S is that of `rough_ice`; gamma =
0.45 gives the gaps of maps that are pressed (`scripts.studies.combined_contact`). The ice adds u -
u_r, at the nominal pressure and at least 0, to H_V.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.special import erf

from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.relaxation.shift import AnyShift
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.surfaces.power_spectrum import PowerSpectrum
from iceslide_fem.surfaces.rough_ice import INCOMPRESSIBLE, Moduli, waves_of

GAMMA = 0.45  # part of the elastic energy that stays where contact is partial
PER_DECADE, ABOVE = 16, 5.0  # pressures of (4), and decades up to full contact
SPEEDS, PRESSURES = (1e-10, 1e4, 5), (1e2, 1e8, 4)  # of tables: m/s, Pa, rows per decade


class Change(NamedTuple):
    """What rough ice changes, arrays of one shape: s of (1), w of (2), and u - u_r, m."""

    pressure: Array
    width: Array
    gap: Array

    def take(self, index: Index) -> Change:
        """The same at `index` of arrays (n,)."""
        return Change(*(part[index] for part in self))

    def reshaped(self, *shape: int) -> Change:
        """The same in another shape."""
        return Change(*(part.reshape(shape) for part in self))


def gap(energies: Array, squares: Array, q: Array, weights: Array, pressure: Array) -> Array:
    """Mean gap (m) by (4) under pressures (Pa, ascending, (n,)).

    energies, squares: of waves, C E (Pa m4) and C E^2 (Pa2 m4) at q (rad/m) with weights of the
    quadrature over ln q, (m,).
    """
    top = pressure[-1] * 10.0**ABOVE
    grid = np.geomspace(pressure[0], top, 1 + round(PER_DECADE * np.log10(top / pressure[0])))
    steps = 0.25 * np.pi * q**4 * squares * weights
    G = (np.cumsum(steps) - 0.5 * steps) / (INCOMPRESSIBLE * grid[:, None]) ** 2
    P = erf(0.5 / np.sqrt(np.maximum(G, np.finfo(float).tiny)))
    stays = P * (GAMMA + (1.0 - GAMMA) * P**2)
    U = 0.5 * np.pi / INCOMPRESSIBLE * stays @ (q**3 * energies * weights)
    x = np.log(grid)
    closing = CubicSpline(x, CubicSpline(x, U).derivative()(x) / grid).antiderivative()
    return np.asarray(closing(x[-1]) - closing(np.log(pressure)))


@dataclass(frozen=True, eq=False)
class CombinedContact:
    """Rubber with waves of its `own` on waves of `ice`.

    own_modulus: E_r, Pa; kelvin: temperature of the rubber, K, None for that of the ice.
    """

    ice: PowerSpectrum
    own: PowerSpectrum
    rubber: Moduli
    shift: AnyShift
    own_modulus: float
    kelvin: float | None = None

    def at(self, pressure: Array, speed: ArrayLike, ice: ArrayLike) -> Change:
        """The change under pressures (Pa), at slip speeds (m/s), above ice of a temperature (K)."""
        kelvin = np.asarray(ice if self.kelvin is None else self.kelvin, dtype=float)
        v, p = np.broadcast_arrays(np.abs(speed) * self.shift(kelvin), pressure)
        x, y = np.log(np.clip(v, *SPEEDS[:2])), np.log(np.clip(p, *PRESSURES[:2]))
        pressed, wider, of_gap = self._tables
        return Change(pressed(x), wider(x), np.maximum(of_gap(x, y, grid=False), 0.0))

    def exact(self, reduced_speed: float, pressure: Array) -> Change:
        """The change at v a_T (m/s), under ascending pressures (Pa, (n,)), without a table."""
        q, weights = waves_of(self.ice, self.own)
        met = self.rubber.means(np.asarray(reduced_speed) * q)[1]
        C, C_r, E_r = self.ice.within(q), self.own.within(q), self.own_modulus
        alone, both = C_r * E_r**2, C * met + C_r * E_r**2
        gaps = [
            gap(energies, squares, q, weights, pressure)
            for energies, squares in ((C_r * E_r, alone), (C * np.sqrt(met) + C_r * E_r, both))
        ]
        less = both @ (q**4 * weights) / (alone @ (q**4 * weights))
        sharper = both @ (q**6 * weights) / (alone @ (q**6 * weights))
        pressed, wider = (
            np.full_like(pressure, one) for one in (less**-0.5, (less / sharper) ** 0.5)
        )
        return Change(pressed, wider, gaps[1] - gaps[0])

    @cached_property
    def _tables(self) -> tuple[CubicSpline, CubicSpline, RectBivariateSpline]:
        """s and w over ln(v a_T), and u - u_r over it and ln p."""
        v, p = (
            np.geomspace(low, high, 1 + round(rows * np.log10(high / low)))
            for low, high, rows in (SPEEDS, PRESSURES)
        )
        rows = [self.exact(speed, p) for speed in v]
        pressed, wider = (np.array([row[i][0] for row in rows]) for i in (0, 1))
        gaps = np.array([row.gap for row in rows])
        x = np.log(v)
        of_gap = RectBivariateSpline(x, np.log(p), gaps, s=0)
        return CubicSpline(x, pressed), CubicSpline(x, wider), of_gap


@lru_cache(maxsize=16)
def combined_contact(
    ice: PowerSpectrum,
    own: PowerSpectrum,
    instantaneous: float,
    relaxation: Relaxation,
    own_modulus: float,
    kelvin: float | None,
) -> CombinedContact:
    """The contact of rubber with an instantaneous modulus (Pa); runs of a sweep share its table."""
    moduli = Moduli.of(instantaneous, relaxation)
    return CombinedContact(ice, own, moduli, relaxation.shift, own_modulus, kelvin)
