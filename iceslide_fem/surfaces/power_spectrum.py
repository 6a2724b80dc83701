"""Isotropic power spectra of rough surfaces, as power laws between rows.

    h_rms^2 = 2 pi int_q0^q1 q C(q) dq                                      (1)

A self-affine surface is one power law with the Hurst exponent H (B. N. J. Persson, J. Chem. Phys.
115 (2001) 3840):

    C = C0 (q/q0)^(-2 (1 + H)),   C0 = h_rms^2 H / (pi q0^2 (1 - (q0/q1)^(2 H)))    (2)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array

ROUNDING = 1e-9  # of wave numbers


@dataclass(frozen=True)
class PowerSpectrum:
    """C (m4) at wave numbers q (rad/m, ascending, two or more); between rows a power law."""

    q: tuple[float, ...]
    C: tuple[float, ...]

    def __call__(self, q: ArrayLike) -> Array:
        """C (m4) at wave numbers (rad/m) of any shape; beyond the ends as they go on."""
        x, y, at = np.log(self.q), np.log(self.C), np.log(np.asarray(q, dtype=float))
        i = np.clip(np.searchsorted(x, at) - 1, 0, len(self.q) - 2)
        return np.asarray(np.exp(y[i] + (y[i + 1] - y[i]) / (x[i + 1] - x[i]) * (at - x[i])))

    def within(self, q: ArrayLike) -> Array:
        """C (m4) at wave numbers (rad/m) of any shape; 0 beyond the ends."""
        at = np.asarray(q, dtype=float)
        inside = (at >= self.q[0] * (1.0 - ROUNDING)) & (at <= self.q[-1] * (1.0 + ROUNDING))
        return np.where(inside, self(at), 0.0)

    @property
    def longest(self) -> float:
        """Longest wave, m."""
        return 2.0 * np.pi / self.q[0]

    @property
    def shortest(self) -> float:
        """Shortest wave, m."""
        return 2.0 * np.pi / self.q[-1]

    @property
    def rms(self) -> float:
        """rms height (m) by (1)."""
        return float(np.sqrt(2.0 * np.pi * self._moments(1).sum()))

    @property
    def slope(self) -> float:
        """rms slope, of the gradient's length."""
        return float(np.sqrt(2.0 * np.pi * self._moments(3).sum()))

    def _moments(self, power: int) -> Array:
        """Integrals of q^power C over the power laws between rows."""
        q, C = np.array(self.q), np.array(self.C)
        ratio = np.log(q[1:] / q[:-1])
        grows = np.log(C[1:] / C[:-1]) / ratio + power + 1.0
        # (exp(x) - 1) / x of x = grows ratio, 1 at 0.
        x = grows * ratio
        mean = np.divide(np.expm1(x), x, out=np.ones_like(x), where=x != 0.0)
        return np.asarray(C[:-1] * q[:-1] ** (power + 1) * ratio * mean)

    def between(self, longest: float, shortest: float) -> PowerSpectrum:
        """The spectrum from a longest to a shortest wave (m); beyond its ends as they go on."""
        low, high = 2.0 * np.pi / longest, 2.0 * np.pi / shortest
        q = [low, *(q for q in self.q if low < q < high), high]
        return PowerSpectrum(tuple(q), tuple(self(q)))

    def scaled(self, rms: float) -> PowerSpectrum:
        """The spectrum with another rms height (m)."""
        factor = (rms / self.rms) ** 2
        return replace(self, C=tuple(factor * value for value in self.C))


def self_affine(rms: float, hurst: float, longest: float, shortest: float) -> PowerSpectrum:
    """The spectrum (2): rms height of its waves (m), Hurst exponent, longest and shortest (m)."""
    q = 2.0 * np.pi / longest, 2.0 * np.pi / shortest
    C0 = rms**2 * hurst / (np.pi * q[0] ** 2 * (1.0 - (q[0] / q[1]) ** (2.0 * hurst)))
    return PowerSpectrum(q, (C0, C0 * (q[1] / q[0]) ** (-2.0 * (1.0 + hurst))))
