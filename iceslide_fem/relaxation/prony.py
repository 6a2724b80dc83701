"""Prony series of relaxation and creep of rubber.

    relaxation   E(t) = E_0 [1 - sum g_i (1 - exp(-t / tau_i))]        (1)
    creep        J(t) = [1 + sum J_i (1 - exp(-t / lambda_i))] / E_0   (2)

g_i and J_i are fractions of the instantaneous modulus and compliance. The long-term modulus is E_0
(1 - sum g_i). Both series are equivalent: their Laplace transforms fulfil s E(s) s J(s) = 1 (J. D.
Ferry, *Viscoelastic Properties of Polymers*, 3rd ed., 1980, chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.relaxation.shift import AnyShift, NoShift
from iceslide_fem.runtime.arrays import Array


@dataclass(frozen=True)
class Creep:
    """J_i and lambda_i (s) of (2), sorted by lambda_i."""

    fractions: tuple[float, ...]
    times: tuple[float, ...]

    def compliance(self, time: ArrayLike) -> Array:
        """E_0 J at `time` (s, any shape) after a step of stress, (2)."""
        t = np.asarray(time, dtype=float)[..., None]
        return np.asarray(1.0 - np.expm1(-t / np.array(self.times)) @ np.array(self.fractions))


@dataclass(frozen=True)
class Prony:
    """g_i and tau_i (s) of (1), sorted by tau_i; all g_i > 0, and their sum is less than 1.

    Elastic rubber has none.
    """

    fractions: tuple[float, ...] = ()
    times: tuple[float, ...] = ()

    @property
    def long_term(self) -> float:
        """The long-term modulus over the instantaneous one."""
        return 1.0 - sum(self.fractions)

    def modulus(self, time: ArrayLike) -> Array:
        """E / E_0 at `time` (s, any shape) after a step of strain, (1)."""
        t = np.asarray(time, dtype=float)[..., None]
        return np.asarray(1.0 + np.expm1(-t / np.array(self.times)) @ np.array(self.fractions))

    def dynamic(self, frequency: ArrayLike) -> Array:
        """(E' + i E'') / E_0 at angular frequencies (rad/s, any shape)."""
        turned = 1j * np.asarray(frequency, dtype=float)[..., None] * np.array(self.times)
        return np.asarray(self.long_term + (turned / (1.0 + turned)) @ np.array(self.fractions))

    def slowed(self, factor: float) -> Prony:
        """The series with all times longer by `factor`, such as a_T."""
        return Prony(self.fractions, tuple(factor * time for time in self.times))

    def in_series(self, ratio: float) -> Prony:
        """The series of this rubber in series with a spring of E_0 / `ratio`.

        Compliances add: the modulus E / (1 + ratio E / E_0) of (1), of which E_0 / (1 + ratio) is
        instantaneous. With the creep series J_i, lambda_i of E + E_0 / ratio it has the fractions
        J_i / ratio and the times lambda_i.
        """
        if not self.fractions:
            return self
        stiffer = Prony(tuple(g * ratio / (1.0 + ratio) for g in self.fractions), self.times)
        return Prony(tuple(J / ratio for J in stiffer.creep.fractions), stiffer.creep.times)

    @cached_property
    def creep(self) -> Creep:
        """The equivalent creep series.

        1 / lambda_j are the zeros of 1 - sum g_i / (1 - s tau_i), one between any two 1 / tau_i and
        one below all; J_j = 1 / sum [g_i tau_i lambda_j / (lambda_j - tau_i)^2].
        """
        from scipy.optimize import brentq  # takes long to import

        g, tau = np.array(self.fractions), np.array(self.times)
        ends = np.append(tau, tau[-1] / self.long_term * (1.0 + 1e-12))
        times, fractions = [], []
        for low, high in zip(ends[:-1], ends[1:], strict=True):

            def modulus(part: float, low: float = low, high: float = high) -> float:
                """Modulus at the fraction exp(part) / (1 + exp(part)) between `low` and `high`."""
                inside = 1.0 / (1.0 + np.exp(-part)), 1.0 / (1.0 + np.exp(part))
                return float(1.0 - _terms(g, tau, low, high, *inside).sum())

            part = brentq(modulus, -80.0, 80.0, xtol=1e-14, rtol=1e-14)
            inside = 1.0 / (1.0 + np.exp(-part)), 1.0 / (1.0 + np.exp(part))
            terms = _terms(g, tau, low, high, *inside)
            time = low + inside[0] * (high - low)
            times.append(float(time))
            fractions.append(float(1.0 / (terms**2 * tau / g).sum() * time))
        return Creep(tuple(fractions), tuple(times))


def _terms(g: Array, tau: Array, low: float, high: float, past: float, before: float) -> Array:
    """g_i lambda / (lambda - tau_i) for lambda between `low` and `high`.

    past, before: distances of lambda from `low` and `high`, over their distance. This is exact even
    if lambda is close to a tau_i.
    """
    distance = np.where(
        tau <= low, (low - tau) + past * (high - low), (high - tau) - before * (high - low)
    )
    return np.asarray(g * (low + past * (high - low)) / distance)


def delayed(before: Array, start: Array, end: Array, steps: Array) -> Array:
    """Exact solution r of tau dr/dt = value - r after a time step, for a linear value.

    r starts from `before`; the value changes linearly from `start` to `end`. `steps` are dt / tau;
    shapes that broadcast.
    """
    kept, reached = np.exp(-steps), mean_response(steps)
    return np.asarray(kept * before + (1.0 - kept) * start + reached * (end - start))


def mean_response(steps: Array) -> Array:
    """1 - (1 - exp(-x)) / x for x = `steps`: `delayed` of a value that rises linearly by 1."""
    x = np.asarray(steps, dtype=float)
    small = np.minimum(x, 0.1)
    series = small / 2 * (1 - small / 3 * (1 - small / 4 * (1 - small / 5 * (1 - small / 6))))
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = 1.0 + np.expm1(-x) / x
    return np.where(x < 0.02, series, exact)


@dataclass(frozen=True)
class Relaxation:
    """`prony` at the reference temperature of `shift`.

    measured: coldest and warmest measured temperature (K), None if they are not known.
    """

    prony: Prony
    shift: AnyShift = NoShift()
    measured: tuple[float, float] | None = None

    def reduced(self, time: ArrayLike, temperature: ArrayLike) -> Array:
        """t / a_T (s) of times (s) at temperatures (K), shapes that broadcast."""
        return np.asarray(np.asarray(time, dtype=float) / self.shift(temperature))

    def compliance(self, time: ArrayLike, temperature: ArrayLike) -> Array:
        """E_0 J at times (s) after a step of stress at a temperature (K)."""
        return self.prony.creep.compliance(self.reduced(time, temperature))

    def modulus(self, time: ArrayLike, temperature: ArrayLike) -> Array:
        """E / E_0 at times (s) after a step of strain at a temperature (K)."""
        return self.prony.modulus(self.reduced(time, temperature))
