"""Pictures of viscoelastic rubber: master curve, shifts, moduli at 1 Hz and over time, stress."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.compound import Compound, temperatures
from iceslide_fem.preprocess.rubber.curves import at_rate, simple_shear, uniaxial
from iceslide_fem.relaxation.shift import NoShift, Shift, ShiftTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS

DPI = 120
LARGEST_STRAIN = 0.5
APART = 20.0  # ratio of largest to smallest stress above which the axis is logarithmic
AROUND = 60.0  # K, shown range around the reference of a scene's rubber
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1)), (0, (1, 3)))
NAMES = ("master_curve", "shift_factors", "temperature", "relaxation", "stress")


def draw(case: RubberCase, found: Compound, out: Path) -> None:
    """Write the pictures of `NAMES` to `out`."""
    master_curve(found).savefig(out / "master_curve.png", dpi=DPI)
    shift_factors(found).savefig(out / "shift_factors.png", dpi=DPI)
    over_temperature(found).savefig(out / "temperature.png", dpi=DPI)
    over_time(case, found).savefig(out / "relaxation.png", dpi=DPI)
    stress(case, found).savefig(out / "stress.png", dpi=DPI)


def _celsius(temperature: float) -> str:
    return f"{temperature - ZERO_CELSIUS:.4g} °C"


def _at(found: Compound) -> str:
    """Reference temperature of a master curve, in words."""
    if found.reference is not None:
        return f" at {_celsius(found.reference)}"
    return f" at {_celsius(found.isotherms[0])}" if found.isotherms.size else ""


def master_curve(found: Compound) -> Figure:
    """Moduli and tan delta over the reduced frequency: measurement and series."""
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    low, high = found.frequencies
    frequency = np.geomspace(low, high, 400)
    moduli = found.modulus * found.relaxation.prony.dynamic(frequency)
    if (measured := found.measured) is not None:
        dma = measured.dma
        for T, colour in zip(found.isotherms, _colours(len(found.isotherms)), strict=True):
            here = dma.temperature == T
            reduced = measured.reduced[here] / (2.0 * np.pi)
            if dma.loss is None or dma.tan_delta is None:  # relaxation: see over_time
                continue
            left.plot(reduced, dma.storage[here] / 1e6, ".", color=colour, label=_celsius(T))
            left.plot(reduced, dma.loss[here] / 1e6, "x", color=colour, ms=4)
            right.plot(reduced, dma.tan_delta[here], ".", color=colour)
    fitted = "series" if found.measured is None else "fit"
    hertz = frequency / (2.0 * np.pi)
    left.plot(hertz, moduli.real / 1e6, "k-", lw=1, label=f"{found.of}′, {fitted}")
    left.plot(hertz, moduli.imag / 1e6, "k--", lw=1, label=f"{found.of}″, {fitted}")
    right.plot(hertz, moduli.imag / moduli.real, "k-", lw=1)
    of = found.of
    dots = found.measured is not None and found.measured.dma.loss is not None
    marks = f"; {of}′: dots, {of}″: crosses" if dots else ""
    left.set(title=f"storage {of}′ and loss modulus {of}″{marks}", ylabel="modulus (MPa)")
    right.set(title="loss factor tan δ", ylabel="tan δ")
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel=f"frequency{_at(found)} (Hz)")
        axes.grid(True, alpha=0.2)
    left.legend(fontsize=7, ncols=2)
    figure.suptitle(_title(found))
    return figure


def _title(found: Compound) -> str:
    arms = len(found.relaxation.prony.times)
    text = f"{found.name}: {arms} arm{'s' * (arms > 1)}"
    if found.measured is None:
        return text
    off = found.measured.misfit
    if off.tan_delta is None:
        return f"{text}, rms {100 * off.storage:.2g} % of {found.of}(t)"
    return (
        f"{text}, rms {100 * off.storage:.2g} % of {found.of}′ and {100 * off.tan_delta:.2g} % of "
        "tan δ"
    )


def shift_factors(found: Compound) -> Figure:
    """log10 a_T over temperature, of single isotherms and of the law."""
    figure = Figure(figsize=(6.5, 4.4), layout="constrained")
    axes = figure.subplots()
    shift, T = found.relaxation.shift, found.isotherms
    if not isinstance(shift, NoShift):
        low, high = span(found, shift)
        line = np.linspace(low - 5.0, high + 5.0, 400)
        with np.errstate(invalid="ignore"):
            logs = np.log10(shift(line))
        there = np.isfinite(logs) & (logs < 30.0)
        axes.plot(line[there] - ZERO_CELSIUS, logs[there], "k-", lw=1, label=shift.words)
        if found.measured is not None and found.measured.factors is not None:
            alone = np.log10(found.measured.factors)
            axes.plot(T - ZERO_CELSIUS, alone, "C0o", ms=5, label="isotherms, each on its own")
        elif T.size:
            axes.plot(
                T - ZERO_CELSIUS, np.log10(shift(T)), "C0o", ms=5, label="isotherms, by this law"
            )
        axes.legend(fontsize=8)
    else:
        axes.text(
            0.5,
            0.5,
            "times do not shift with the temperature",
            ha="center",
            transform=axes.transAxes,
        )
    axes.set(
        xlabel="temperature (°C)",
        ylabel="$\\log_{10}\\, a_T$",
        title="how times stretch: $\\tau(T) = a_T\\, \\tau$(reference)",
    )
    axes.grid(True, alpha=0.2)
    return figure


def span(found: Compound, shift: Shift | ShiftTable) -> tuple[float, float]:
    """Range of drawn temperatures (K)."""
    T = found.isotherms
    if T.size:
        return float(T.min()), float(T.max())
    return shift.reference - AROUND, shift.reference + AROUND


def over_temperature(found: Compound) -> Figure:
    """Moduli and tan delta at 1 Hz over temperature."""
    figure = Figure(figsize=(6.5, 4.4), layout="constrained")
    axes = figure.subplots()
    shift = found.relaxation.shift
    if not isinstance(shift, NoShift):
        line = np.linspace(*span(found, shift), 300)
        line = line[np.isfinite(shift(line))]
        moduli = found.modulus * found.relaxation.prony.dynamic(2.0 * np.pi * shift(line))
        axes.semilogy(line - ZERO_CELSIUS, moduli.real / 1e6, "C0-", label=f"{found.of}′")
        axes.semilogy(line - ZERO_CELSIUS, moduli.imag / 1e6, "C1--", label=f"{found.of}″")
        beside = axes.twinx()
        beside.plot(line - ZERO_CELSIUS, moduli.imag / moduli.real, "C2:", label="tan δ (right)")
        beside.set(ylabel="tan δ")
        lines = [*axes.get_lines(), *beside.get_lines()]
        axes.legend(lines, [str(each.get_label()) for each in lines], fontsize=8)
    else:
        axes.text(
            0.5,
            0.5,
            "times do not shift with the temperature",
            ha="center",
            transform=axes.transAxes,
        )
    axes.set(
        xlabel="temperature (°C)", ylabel="modulus (MPa)", title="moduli at 1 Hz over temperature"
    )
    axes.grid(True, alpha=0.2)
    return figure


def over_time(case: RubberCase, found: Compound) -> Figure:
    """The relaxation modulus over the known times, at some temperatures."""
    figure = Figure(figsize=(6.5, 4.4), layout="constrained")
    axes = figure.subplots()
    low, high = found.frequencies
    reduced, prony = np.geomspace(1.0 / high, 1.0 / low, 400), found.relaxation.prony
    shown = temperatures(case, found)
    everywhere = found.reference is None and not found.isotherms.size
    for T, colour in zip(shown, _colours(len(shown)), strict=True):
        times = reduced * found.relaxation.shift(T)
        label = "any temperature" if everywhere else _celsius(T)
        axes.loglog(times, found.modulus * prony.modulus(reduced) / 1e6, color=colour, label=label)
    if found.measured is not None and found.measured.dma.loss is None:
        dma = found.measured.dma
        for T, colour in zip(found.isotherms, _colours(len(found.isotherms)), strict=True):
            here = dma.temperature == T
            label = f"{_celsius(T)}, measured"
            times = 1.0 / dma.frequency[here]
            axes.loglog(times, dma.storage[here] / 1e6, ".", color=colour, label=label)
    for value, name in ((1.0, "instantaneous"), (prony.long_term, "long-term")):
        axes.axhline(found.modulus * value / 1e6, color="0.6", lw=0.8, ls=":")
        axes.text(
            0.01, found.modulus * value / 1e6, name, transform=axes.get_yaxis_transform(),
            va="bottom", fontsize=7, color="0.4",
        )  # fmt: skip
    axes.set(
        xlabel="time after a step of strain (s)",
        ylabel=f"{found.of}(t) (MPa)",
        title="relaxation modulus over the times that are known",
    )
    axes.legend(fontsize=8)
    axes.grid(True, alpha=0.2)
    return figure


def stress(case: RubberCase, found: Compound) -> Figure:
    """Stress-strain curves of a bar and of simple shear, by rate and temperature."""
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    shown, prony = temperatures(case, found), found.relaxation.prony
    panels = figure.subplots(1, 2)
    for axes, path in zip(panels, (uniaxial, simple_shear), strict=True):
        for T, colour in zip(shown, _colours(len(shown)), strict=True):
            for rate, line in zip(case.rates, LINES, strict=False):
                reduced = rate * float(found.relaxation.shift(T))
                strain, pulled = at_rate(found.constants, prony, path, LARGEST_STRAIN, reduced)
                label = f"{_celsius(T)}, {rate:g} 1/s"
                axes.plot(strain, pulled / 1e6, color=colour, ls=line, label=label)
        axes.grid(True, alpha=0.2)
        _readable(axes)
    panels[0].set(
        title="a bar, drawn at a constant rate", xlabel="strain", ylabel="nominal stress (MPa)"
    )
    panels[1].set(
        title="simple shear at a constant rate", xlabel="shear", ylabel="shear stress (MPa)"
    )
    panels[0].legend(fontsize=7)
    return figure


def _readable(axes: Axes) -> None:
    """Logarithmic axis if curves would otherwise lie on the axis."""
    ends = [float(np.asarray(line.get_ydata())[-1]) for line in axes.get_lines()]
    if max(ends) > APART * min(ends):
        axes.set_yscale("log")
        axes.set_ylim(bottom=1e-2 * min(ends))


def _colours(number: int) -> Sequence[tuple[float, ...]]:
    """Colours from cold to warm."""
    return [matplotlib.colormaps["plasma"](0.85 * x) for x in _spread(number)]


def _spread(number: int) -> Array:
    return np.linspace(0.0, 1.0, number) if number > 1 else np.array([0.0])
