"""What is doubtful about a compound: its table, the fit to it, and its use at a temperature."""

from __future__ import annotations

import numpy as np

from iceslide_fem.relaxation.dma_fit import Characterised
from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.relaxation.prony_fit import fine_grid, spectrum
from iceslide_fem.relaxation.shift import NoShift
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS, celsius

# Errors of a fit above which it is poor: root mean squares of the logarithms, the largest one.
POOR_STORAGE, POOR_TAN_DELTA, POOR = 0.1, 0.2, np.log(2.0)
OFF_THE_LAW = 0.3  # decades of an isotherm
FURTHEST = 1.0  # K from the measured temperatures
# K from the measured temperatures up to which undetermined constants may be used.
FURTHEST_UNDETERMINED = 10.0
WORTH_SAYING = 0.8  # ratio of the errors of two fits


def of_fit(found: Characterised) -> list[str]:
    """Doubts about a table and the fit to it, without full stop."""
    return [*found.dma.doubts, *_poor(found), *_shift(found)]


def of_use(relaxation: Relaxation, temperature: float) -> list[str]:
    """Doubts about a compound at a temperature (K), without full stop."""
    at = celsius(temperature)
    if (measured := relaxation.measured) is None:
        if not isinstance(relaxation.shift, NoShift):
            return []
        return [
            f"the rubber's times do not shift with temperature: they are taken as those at {at}"
        ]
    beyond = outside(relaxation, temperature)
    if beyond <= FURTHEST:
        return []
    where = f"{beyond:.0f} K {'colder' if temperature < measured[0] else 'warmer'} than "
    if measured[0] == measured[1]:
        wrong = "short" if temperature < measured[0] else "long"
        return [
            f"{at} is {where}the one isotherm of the rubber, {celsius(measured[0])}: its times "
            f"are too {wrong} by an unknown factor"
        ]
    nearest = measured[0] if temperature < measured[0] else measured[1]
    return [
        f"{at} is {where}the nearest isotherm of the rubber, {celsius(nearest)}: the shift of its "
        "times is extrapolated"
    ]


def outside(relaxation: Relaxation, temperature: float) -> float:
    """How far (K) a temperature is outside the measured ones; 0 if they are not known."""
    if relaxation.measured is None:
        return 0.0
    low, high = relaxation.measured
    return max(low - temperature, temperature - high, 0.0)


def _poor(found: Characterised) -> list[str]:
    off, dma = found.misfit, found.dma
    tan_delta = off.tan_delta or 0.0
    if off.storage <= POOR_STORAGE and tan_delta <= POOR_TAN_DELTA and abs(off.largest) <= POOR:
        return []
    first = f"ln {dma.of}{'(t)' if dma.loss is None else chr(39)}"
    means = f"{off.storage:.2g} in {first}"
    if off.tan_delta is not None:
        means += f" and {tan_delta:.2g} in ln tan delta"
    at = f"{dma.frequency[off.row] / (2.0 * np.pi):.3g} Hz, {celsius(dma.temperature[off.row])}"
    text = (
        f"the fit is poor: off by {means} (root mean square), and by a factor of "
        f"{np.exp(abs(off.largest)):.2g} in {off.quantity} at {at}"
    )
    law = found.relaxation.shift(dma.temperature)
    own = _error(found, dma.frequency * law, found.relaxation.prony.times)
    more = _error(found, dma.frequency * law)
    text += f": with any number of arms the moduli are off by {more:.2g} instead of {own:.2g}"
    if found.factors is not None:
        each = found.factors[np.searchsorted(dma.isotherms, dma.temperature)]
        free = _error(found, dma.frequency * each)
        text += f", and by {free:.2g} with a shift of each isotherm's own"
        if free < WORTH_SAYING * more:
            text += " (--shift table)"
    return [text]


def _error(found: Characterised, reduced: Array, times: tuple[float, ...] | None = None) -> float:
    """Relative error of a series (root mean square), by default with any number of arms."""
    data = reduced, found.dma.storage, found.dma.loss
    grid = fine_grid(reduced) if times is None else np.array(times)
    return float(np.sqrt(np.mean(spectrum(*data, grid)[1] ** 2)))


def _shift(found: Characterised) -> list[str]:
    result = []
    isotherms = found.dma.isotherms
    span = f"{isotherms[0] - ZERO_CELSIUS:.4g} to {celsius(isotherms[-1])}"
    if found.factors is not None:
        decades = np.log10(found.factors / found.relaxation.shift(isotherms))
        worst = int(np.abs(decades).argmax())
        if abs(decades[worst]) > OFF_THE_LAW:
            result.append(
                f"isotherms are up to {abs(decades[worst]):.2g} decades off the law of the shift "
                f"({celsius(isotherms[worst])}): it does not hold for this rubber (--shift table)"
            )
    if not found.determined:
        result.append(
            f"isotherms from {span} do not determine C1 and C2: log a_T over the temperature is a "
            "straight line there. Outside of this range the shift is a guess"
        )
    if (
        len(isotherms) == 1
        and found.factors is None
        and isinstance(found.relaxation.shift, NoShift)
    ):
        result.append(
            f"one isotherm says nothing about other temperatures: the times are those at "
            f"{celsius(isotherms[0])}"
        )
    return result
