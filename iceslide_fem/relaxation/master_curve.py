"""From isotherms to a master curve: shift of each isotherm, and the shift law.

In the common range of E'(w) at two temperatures, log a_T is the mean distance in log w (M.
Gergesova, B. Zupancic, I. Saprunov, I. Emri, J. Rheol. 55 (2011) 1). All shifts are then refined
together, so that one non-negative relaxation spectrum fits both moduli best.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from iceslide_fem.relaxation.dma import Dma
from iceslide_fem.relaxation.prony_fit import spectrum
from iceslide_fem.relaxation.shift import GAS_CONSTANT, Shift, ShiftTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import celsius

PER_DECADE = 4.0  # times per decade of the spectrum
FURTHEST = 1.5  # decades, largest total correction of the first shifts
# Search range of C2 (K) relative to the coldest isotherm.
LOWEST_C2, HIGHEST_C2 = 1.0, 5e3
# Decades that a straight line through the shifts may be worse than WLF without being told apart.
CANNOT_TELL = 0.05


_UNLIKE_RUBBER = (
    "its isotherms do not shift as those of rubber, which relaxes more slowly the colder it is; "
    "needed: moduli that rise with the frequency and fall with the temperature, or the constants "
    "of a WLF shift"
)


def shifts(dma: Dma, said: str) -> Array:
    """ln a_T of each isotherm, (isotherms,), 0 at the coldest one.

    Raises SceneError if neighbours have no storage modulus in common.
    """
    from scipy.optimize import least_squares  # takes long to import

    temperatures = dma.isotherms
    first = [0.0]
    for cold, warm in pairwise(temperatures):
        first.append(first[-1] - _between(dma, cold, warm, said))
    if len(first) == 1:
        return np.zeros(1)
    which = np.searchsorted(temperatures, dma.temperature)
    reduced = np.log(dma.frequency) + np.array(first)[which]
    decades = -reduced.max() / np.log(10.0) - FURTHEST, -reduced.min() / np.log(10.0) + FURTHEST
    times = np.logspace(*decades, 1 + round(PER_DECADE * (decades[1] - decades[0])))

    def off(free: Array) -> Array:
        all_shifts = np.concatenate([[0.0], free])
        frequency = dma.frequency * np.exp(all_shifts[which])
        return spectrum(frequency, dma.storage, dma.loss, times)[1]

    return np.concatenate([[0.0], least_squares(off, np.array(first[1:]), max_nfev=20).x])


def _between(dma: Dma, cold: float, warm: float, said: str) -> float:
    """ln a_T of a cold isotherm (K) minus that of a warm one, from the storage modulus."""
    curves = []
    for temperature in (cold, warm):
        here = dma.temperature == temperature
        # Sorted separately, so noise cannot make a modulus fall with frequency.
        curves.append((np.sort(np.log(dma.storage[here])), np.sort(np.log(dma.frequency[here]))))
    low, high = max(curve[0][0] for curve in curves), min(curve[0][-1] for curve in curves)
    if low >= high:
        ranges = " and ".join(
            f"{np.exp(curve[0][0]) / 1e6:.4g} to {np.exp(curve[0][-1]) / 1e6:.4g} MPa"
            for curve in curves
        )
        raise SceneError(
            f"{said}: the isotherms of {celsius(cold)} and {celsius(warm)} do not overlap, with "
            f"storage moduli of {ranges}; needed: temperatures closer to each other, more "
            "frequencies, or the constants of a WLF shift"
        )
    levels = np.linspace(low, high, 50)
    of_cold, of_warm = (np.interp(levels, *curve) for curve in curves)
    return float(np.mean(of_warm - of_cold))


def wlf(
    temperatures: Array, logs: Array, reference: float, arrhenius_below: float | None, said: str
) -> tuple[Shift, bool]:
    """WLF, and Arrhenius below a temperature (K), through shifts of isotherms, by least squares.

    temperatures: K; logs: ln a_T up to a constant, both (isotherms,); reference: temperature with
    a_T = 1, K. Also whether the isotherms determine C2: a straight line describes them worse.
    Raises SceneError for too few isotherms, or shifts unlike those of rubber.
    """
    kink = -np.inf if arrhenius_below is None else arrhenius_below
    warm = temperatures >= kink
    if warm.sum() < 3:
        raise SceneError(
            f"{said}: {warm.sum()} isotherms{_above(arrhenius_below)} do not say what C1 and C2 of "
            "a WLF shift are; needed: 3 or more, the constants, or iceslide rubber --shift with "
            "arrhenius or table"
        )
    shift, determined = _wlf(temperatures[warm], logs[warm], said)
    if arrhenius_below is not None and not warm.all():
        shift = _arrhenius(shift, temperatures, logs, arrhenius_below, said)
    return shift.moved(reference), determined


def arrhenius(temperatures: Array, logs: Array, reference: float, said: str) -> ShiftTable:
    """One activation energy through shifts of isotherms, by least squares; as for `wlf`."""
    inverse = 1.0 / temperatures
    slope, constant = np.polyfit(inverse, logs, 1)
    if slope <= 0.0:
        raise SceneError(f"{said}: {_UNLIKE_RUBBER}")
    ends = inverse[[0, -1]]
    return _table(temperatures[[0, -1]], slope * ends + constant).moved(reference)


def free(temperatures: Array, logs: Array, reference: float, said: str) -> ShiftTable:
    """The shift of each isotherm as it is; as for `wlf`."""
    if (np.diff(logs) >= 0.0).any():
        raise SceneError(f"{said}: {_UNLIKE_RUBBER}")
    return _table(temperatures, logs).moved(reference)


def _table(temperatures: Array, logs: Array) -> ShiftTable:
    return ShiftTable(tuple(temperatures.tolist()), tuple((logs / np.log(10.0)).tolist()))


def _above(arrhenius_below: float | None) -> str:
    return "" if arrhenius_below is None else f" from {celsius(arrhenius_below)} on"


def _wlf(temperatures: Array, logs: Array, said: str) -> tuple[Shift, bool]:
    """WLF relative to the coldest isotherm. For a given C2 the other constants are linear."""
    from scipy.optimize import minimize_scalar  # takes long to import

    above = temperatures - temperatures[0]

    def solved(log_C2: float) -> tuple[Array, float]:
        curve = -above / (np.exp(log_C2) + above) * np.log(10.0)
        matrix = np.column_stack([curve, np.ones_like(curve)])
        constants = np.linalg.lstsq(matrix, logs, rcond=None)[0]
        return constants, float(((matrix @ constants - logs) ** 2).sum())

    tried = np.linspace(np.log(LOWEST_C2), np.log(HIGHEST_C2), 60)
    best = int(np.argmin([solved(each)[1] for each in tried]))
    ends = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    log_C2 = minimize_scalar(
        lambda each: solved(each)[1], bounds=ends, method="bounded", options={"xatol": 1e-9}
    ).x
    C1 = float(solved(log_C2)[0][0])
    if C1 <= 0.0:
        raise SceneError(f"{said}: {_UNLIKE_RUBBER}")
    off, line = (np.sqrt(solved(each)[1] / len(logs)) for each in (log_C2, np.log(HIGHEST_C2)))
    determined = line - off > CANNOT_TELL * np.log(10.0)
    return Shift(C1, float(np.exp(log_C2)), float(temperatures[0])), bool(determined)


def _arrhenius(shift: Shift, temperatures: Array, logs: Array, below: float, said: str) -> Shift:
    """WLF with the activation energy of the isotherms below a temperature (K)."""
    warm = temperatures >= below
    offset = float(np.mean(logs[warm] - np.log(shift(temperatures[warm]))))
    further = logs[~warm] - offset - np.log(float(shift(below)))
    inverse = 1.0 / temperatures[~warm] - 1.0 / below
    energy = GAS_CONSTANT * float(inverse @ further) / float(inverse @ inverse)
    if energy <= 0.0:
        raise SceneError(
            f"{said}: isotherms below {celsius(below)} do not relax more slowly the colder they "
            "are; allowed: no Arrhenius shift, or one below another temperature"
        )
    return Shift(shift.C1, shift.C2, shift.reference, below, energy)
