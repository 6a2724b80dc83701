"""Charts of viscoelastic rubber: master curve, shifts, moduli at 1 Hz and over time, stress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from iceslide_fem.postprocess.report.page import Chart, Curve
from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.compound import (
    Compound,
    at_rate,
    simple_shear,
    temperatures,
    uniaxial,
)
from iceslide_fem.relaxation.shift import NoShift, Shift, ShiftTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS, celsius

LARGEST_STRAIN = 0.5
APART = 20.0  # ratio of largest to smallest stress above which the axis is logarithmic
AROUND = 60.0  # K, shown range around the reference of a scene's rubber
LONGEST_SHIFT = 30.0  # decades


def charts(case: RubberCase, found: Compound) -> Mapping[str, Sequence[Chart]]:
    """Charts by the names of pictures; none of the shift where times do not shift."""
    shift = found.relaxation.shift
    of_shift: dict[str, Sequence[Chart]] = {}
    if not isinstance(shift, NoShift):
        line = _temperatures(found, shift)
        of_shift = {
            "shift_factors": [_shift_factors(found, shift, line)],
            "temperature": _over_temperature(found, line),
        }
    return {
        "master_curve": _master_curve(found),
        **of_shift,
        "relaxation": [_over_time(case, found)],
        "stress": _stress(case, found),
    }


def _master_curve(found: Compound) -> list[Chart]:
    """Moduli and tan delta over the reduced frequency: measurement and series."""
    low, high = found.frequencies
    frequency, of = np.geomspace(low, high, 400), found.of
    moduli = found.modulus * found.relaxation.prony.dynamic(frequency)
    hertz, fitted = frequency / (2.0 * np.pi), "series" if found.measured is None else "fit"
    curves = [
        Curve(f"{of}', {fitted}", hertz, moduli.real / 1e6),
        Curve(f"{of}'', {fitted}", hertz, moduli.imag / 1e6, 1),
    ]
    ratio = [Curve(fitted, hertz, moduli.imag / moduli.real)]
    measured = found.measured
    if measured is not None and measured.dma.loss is not None:
        order, dma = np.argsort(measured.reduced), measured.dma
        x, storage, loss = measured.reduced[order] / (2.0 * np.pi), dma.storage, measured.dma.loss
        curves += [
            Curve(f"{of}', measured", x, storage[order] / 1e6, 0, True),
            Curve(f"{of}'', measured", x, loss[order] / 1e6, 1, True),
        ]
        ratio.append(Curve("measured", x, (loss / storage)[order], 0, True))
    at = found.reference if found.reference is not None else next(iter(found.isotherms), None)
    where = f"reduced frequency{'' if at is None else f' at {celsius(at)}'} (Hz)"
    said = "Moduli over the reduced frequency."
    return [
        Chart("moduli", f"Storage and loss modulus, {of}' and {of}''", said, where,
              "modulus (MPa)", curves, logarithmic="xy"),
        Chart("tan", "Loss factor", "Tan delta over the reduced frequency.", where, "tan delta",
              ratio, logarithmic="xy"),
    ]  # fmt: skip


def _temperatures(found: Compound, shift: Shift | ShiftTable) -> Array:
    """Drawn temperatures (K) at which the shift has a value."""
    T = found.isotherms
    ends = (T.min(), T.max()) if T.size else (shift.reference - AROUND, shift.reference + AROUND)
    line = np.linspace(ends[0] - 5.0, ends[1] + 5.0, 400)
    with np.errstate(invalid="ignore"):
        logs = np.log10(shift(line))
    return line[np.isfinite(logs) & (logs < LONGEST_SHIFT)]


def _shift_factors(found: Compound, shift: Shift | ShiftTable, line: Array) -> Chart:
    """log10 a_T over temperature, of single isotherms and of the law."""
    T, curves = found.isotherms, [Curve(shift.words, line - ZERO_CELSIUS, np.log10(shift(line)))]
    if found.measured is not None and found.measured.factors is not None:
        alone = np.log10(found.measured.factors)
        curves.append(Curve("isotherms, each on its own", T - ZERO_CELSIUS, alone, 1, True))
    elif T.size:
        by_law = np.log10(shift(T))
        curves.append(Curve("isotherms, by this law", T - ZERO_CELSIUS, by_law, 1, True))
    said = "Times are longer in the cold: tau(T) = a_T tau(reference)."
    return Chart("shift", "Shift factors", said, "temperature (°C)", "log10 a_T", curves)


def _over_temperature(found: Compound, line: Array) -> list[Chart]:
    """Moduli and tan delta at 1 Hz."""
    reduced = 2.0 * np.pi * found.relaxation.shift(line)
    moduli, T = found.modulus * found.relaxation.prony.dynamic(reduced), line - ZERO_CELSIUS
    curves = [
        Curve(f"{found.of}'", T, moduli.real / 1e6),
        Curve(f"{found.of}''", T, moduli.imag / 1e6, 1),
    ]
    ratio = [Curve("tan delta", T, moduli.imag / moduli.real)]
    said, x = "Of a test at 1 Hz.", "temperature (°C)"
    return [
        Chart("cold", "Moduli at 1 Hz", said, x, "modulus (MPa)", curves, logarithmic="y"),
        Chart("cold-tan", "Loss factor at 1 Hz", said, x, "tan delta", ratio),
    ]


def _over_time(case: RubberCase, found: Compound) -> Chart:
    """The relaxation modulus over the known times, at some temperatures."""
    low, high = found.frequencies
    reduced, prony = np.geomspace(1.0 / high, 1.0 / low, 400), found.relaxation.prony
    modulus, everywhere = found.modulus / 1e6, found.reference is None and not found.isotherms.size
    curves = [
        Curve(
            "any temperature" if everywhere else celsius(T),
            reduced * found.relaxation.shift(T), modulus * prony.modulus(reduced), look,
        )
        for look, T in enumerate(temperatures(case, found))
    ]  # fmt: skip
    if found.measured is not None and found.measured.dma.loss is None:
        dma = found.measured.dma
        for T in found.isotherms:
            here, name = dma.temperature == T, f"{celsius(T)}, measured"
            times, storage = 1.0 / dma.frequency[here], dma.storage[here] / 1e6
            curves.append(Curve(name, times, storage, len(curves), True))
    said = (
        f"From {modulus:.4g} MPa at once to {modulus * prony.long_term:.4g} MPa in the end, over "
        "the times that are known."
    )
    x, y = "time after a step of strain (s)", f"{found.of}(t) (MPa)"
    return Chart("relaxation", "Relaxation modulus", said, x, y, curves, logarithmic="xy")


def _stress(case: RubberCase, found: Compound) -> list[Chart]:
    """Stress-strain curves of a bar and of simple shear, by rate and temperature."""
    drawn, prony = [], found.relaxation.prony
    for name, title, path in (
        ("bar", "A bar, drawn at a constant rate: nominal stress", uniaxial),
        ("shear", "Simple shear at a constant rate", simple_shear),
    ):
        curves: list[Curve] = []
        for T in temperatures(case, found):
            for rate in case.rates:
                reduced = rate * float(found.relaxation.shift(T))
                strain, stress = at_rate(found.constants, prony, path, LARGEST_STRAIN, reduced)
                label = f"{celsius(T)}, {rate:g} 1/s"
                curves.append(Curve(label, strain[1:], stress[1:] / 1e6, len(curves)))
        said = "Rubber is stiffer the faster and the colder it is strained."
        ends = [float(np.asarray(curve.y)[-1]) for curve in curves]
        scale = "y" if max(ends) > APART * min(ends) else ""
        drawn.append(Chart(name, title, said, "strain", "stress (MPa)", curves, logarithmic=scale))
    return drawn
