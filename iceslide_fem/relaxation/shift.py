"""Shift of relaxation times with temperature: WLF, and Arrhenius at low temperature.

    log10 a_T = -C_1 (T - T_r) / (C_2 + T - T_r),   tau(T) = a_T tau(T_r)        (1)

M. L. Williams, R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701. Cold rubber relaxes
slowly: a_T > 1 below the reference T_r.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array

GAS_CONSTANT = 8.314462618  # J/(mol K)


@dataclass(frozen=True)
class Shift:
    """C1 (of log10), C2 (K) and the reference temperature T_r (K) of (1).

    Below `arrhenius_below` (K) the Arrhenius law with the `activation_energy` E (J/mol) adds E / R
    (1 / T - 1 / arrhenius_below) to ln a_T at that temperature.
    """

    C1: float
    C2: float
    reference: float
    arrhenius_below: float = 0.0
    activation_energy: float = 0.0

    def __call__(self, temperature: ArrayLike) -> Array:
        """a_T at temperatures (K) of any shape; infinite where (1) is undefined."""
        T = np.asarray(temperature, dtype=float)
        above = np.maximum(T, self.arrhenius_below) - self.reference
        with np.errstate(divide="ignore", over="ignore"):
            log = np.where(self.C2 + above > 0.0, -self.C1 * above / (self.C2 + above), np.inf)
            factor = 10.0**log
        if not self.activation_energy:
            return np.asarray(factor)
        colder = np.minimum(T, self.arrhenius_below)
        beyond = self.activation_energy / GAS_CONSTANT * (1.0 / colder - 1.0 / self.arrhenius_below)
        return np.asarray(factor * np.exp(beyond))

    def moved(self, reference: float) -> Shift:
        """The same curve with another reference temperature (K)."""
        further = self.C2 + reference - self.reference
        return replace(self, C1=self.C1 * self.C2 / further, C2=further, reference=reference)


@dataclass(frozen=True)
class NoShift:
    """No shift with temperature."""

    def __call__(self, temperature: ArrayLike) -> Array:
        """a_T = 1."""
        return np.ones_like(np.asarray(temperature, dtype=float))
