"""Shift of relaxation times with temperature: WLF, and Arrhenius at low temperature.

    log10 a_T = -C_1 (T - T_r) / (C_2 + T - T_r),   tau(T) = a_T tau(T_r)        (1)

M. L. Williams, R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701. Cold rubber relaxes
slowly: a_T > 1 below the reference T_r. Where neither law holds, factors of single temperatures are
a table.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import celsius

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

    @property
    def words(self) -> str:
        """The law and its constants for a reader."""
        text = f"WLF: C1 = {self.C1:.4g} (log10), C2 = {self.C2:.4g} K, reference "
        text += celsius(self.reference)
        if self.activation_energy:
            text += f"; {self.activation_energy / 1e3:.4g} kJ/mol below "
            text += celsius(self.arrhenius_below)
        return text


@dataclass(frozen=True)
class ShiftTable:
    """log10 a_T at temperatures (K, ascending); in between an activation energy.

    log a_T is linear in 1 / T between neighbours, and goes on as it ends. Two rows are the
    Arrhenius law.
    """

    temperatures: tuple[float, ...]
    logs: tuple[float, ...]

    def __call__(self, temperature: ArrayLike) -> Array:
        """a_T at temperatures (K) of any shape."""
        inverse = 1.0 / np.asarray(temperature, dtype=float)
        x, y = 1.0 / np.array(self.temperatures[::-1]), np.array(self.logs[::-1])
        i = np.clip(np.searchsorted(x, inverse) - 1, 0, len(x) - 2)
        log = y[i] + (y[i + 1] - y[i]) / (x[i + 1] - x[i]) * (inverse - x[i])
        with np.errstate(over="ignore"):
            return np.asarray(10.0**log)

    @property
    def rows(self) -> list[list[float]]:
        """Rows of temperature (K) and log10 a_T."""
        return [list(row) for row in zip(self.temperatures, self.logs, strict=True)]

    @property
    def reference(self) -> float:
        """The temperature (K) in the table's range with a_T = 1, or the nearest one."""
        return float(1.0 / np.interp(0.0, self.logs[::-1], 1.0 / np.array(self.temperatures[::-1])))

    def moved(self, reference: float) -> ShiftTable:
        """The same curve with another reference temperature (K)."""
        log = float(np.log10(self(reference)))
        return replace(self, logs=tuple(each - log for each in self.logs))

    @property
    def words(self) -> str:
        """The law and its constants for a reader."""
        reference = f"reference {celsius(self.reference)}"
        (T1, T2), (log1, log2) = self.temperatures[:2], self.logs[:2]
        if len(self.logs) > 2:
            return f"{len(self.logs)} factors, {reference}"
        energy = GAS_CONSTANT * np.log(10.0) * (log1 - log2) / (1.0 / T1 - 1.0 / T2)
        return f"Arrhenius: {energy / 1e3:.4g} kJ/mol, {reference}"


def arrhenius(energy: float, reference: float) -> ShiftTable:
    """The shift by an activation energy (J/mol) from a reference temperature (K)."""
    colder = 0.5 * reference
    log = energy / GAS_CONSTANT / np.log(10.0) * (1.0 / colder - 1.0 / reference)
    return ShiftTable((colder, reference), (float(log), 0.0))


@dataclass(frozen=True)
class NoShift:
    """No shift with temperature."""

    def __call__(self, temperature: ArrayLike) -> Array:
        """a_T = 1."""
        return np.ones_like(np.asarray(temperature, dtype=float))

    @property
    def words(self) -> str:
        """The law for a reader."""
        return "none"


AnyShift = Shift | ShiftTable | NoShift
