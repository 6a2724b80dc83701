"""The page of `iceslide rubber`: fit, errors, and curves with zoom."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.postprocess.report.page import Cell, Chart, Curve, Page, Section, Table, Text
from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.compound import Compound, temperatures
from iceslide_fem.preprocess.rubber.curves import at_rate, simple_shear, uniaxial
from iceslide_fem.preprocess.rubber.figures import APART, LARGEST_STRAIN, span
from iceslide_fem.preprocess.rubber.output import fragment
from iceslide_fem.relaxation.shift import NoShift
from iceslide_fem.runtime.units import ZERO_CELSIUS

LEFT_OUT = (
    "Moduli are those of one small amplitude: no Payne effect, no softening by earlier strains. "
    "Volume changes are elastic, moduli are not shifted vertically, and hysteresis on rough ice is "
    "left out (docs/explanation/relaxation.md)."
)


def page_of_rubber(
    case: RubberCase, found: Compound, figures: Mapping[str, Any], rows: Sequence[tuple[str, str]]
) -> Page:
    """The page of a compound; rows: names and values of its main figures."""
    arms = [[Cell(f"{tau:.4g}"), Cell(f"{g:.5g}")] for g, tau in figures["prony"]]
    table = Table("What was found", ["figure", "value"], [[Cell(a), Cell(b)] for a, b in rows])
    notes = [Text(f"{note[:1].upper()}{note[1:]}.", "warning") for note in figures["warnings"]]
    kind = "Young's" if found.of == "E" else "shear"
    return Page(
        title=f"{found.name}: rubber that relaxes",
        summary=f"{len(arms)} arms, from {found.modulus / 1e6:.4g} MPa at once to "
        f"{found.modulus * found.relaxation.prony.long_term / 1e6:.4g} MPa in the end "
        f"({kind} modulus).",
        sections=[
            Section("results", "Results", [table]),
            Section("warnings", "Warnings", notes or [Text("There was no warning.")]),
            Section("curves", "Curves", [*_moduli(found), *_shift(found), *_stress(case, found)]),
            Section(
                "arms", "Arms",
                [Table("The Prony series", ["tau (s)", "g of the instantaneous modulus"], arms)],
            ),
            Section("neglected", "What is left out", [Text(LEFT_OUT)]),
            Section(
                "again", "Use it, and run it again",
                [Text(fragment(found), "code"), Text(_command(case), "code")],
            ),
        ],
    )  # fmt: skip


def _moduli(found: Compound) -> list[Chart]:
    low, high = found.frequencies
    frequency = np.geomspace(low, high, 400)
    prony, of = found.relaxation.prony, found.of
    moduli, hertz = found.modulus * prony.dynamic(frequency), frequency / (2.0 * np.pi)
    curves = [
        Curve(f"{of}'", hertz, moduli.real / 1e6),
        Curve(f"{of}''", hertz, moduli.imag / 1e6, 1),
    ]
    ratio = [Curve("tan delta", hertz, moduli.imag / moduli.real)]
    times = 1.0 / frequency[::-1]
    fall = [Curve(f"{of}(t)", times, found.modulus * prony.modulus(times) / 1e6)]
    if (measured := found.measured) is not None:
        order, dma = np.argsort(measured.reduced), measured.dma
        x, storage = measured.reduced[order] / (2.0 * np.pi), dma.storage[order] / 1e6
        if dma.loss is None or dma.tan_delta is None:
            at = 1.0 / measured.reduced[order]
            fall.append(Curve("measured", at[::-1], storage[::-1], 0, True))
        else:
            curves += [
                Curve(f"{of}' measured", x, storage, 0, True),
                Curve(f"{of}'' measured", x, dma.loss[order] / 1e6, 1, True),
            ]
            ratio.append(Curve("measured", x, dma.tan_delta[order], 0, True))
    where = "reduced frequency (Hz)"
    return [
        Chart("moduli", "Storage and loss modulus", "Moduli over the reduced frequency.", where,
              "modulus (MPa)", curves, logarithmic="xy"),
        Chart("tan", "Loss factor", "Tan delta over the reduced frequency.", where, "tan delta",
              ratio, logarithmic="xy"),
        Chart("relaxation", "Relaxation modulus", "It falls with the time after a step of strain.",
              "reduced time (s)", f"{of}(t) (MPa)", fall, logarithmic="xy"),
    ]  # fmt: skip


def _shift(found: Compound) -> list[Chart]:
    shift, T = found.relaxation.shift, found.isotherms
    if isinstance(shift, NoShift):
        return []
    line = np.linspace(*span(found, shift), 200)
    line = line[np.isfinite(shift(line))]
    curves = [Curve("law", line - ZERO_CELSIUS, np.log10(shift(line)))]
    if found.measured is not None and found.measured.factors is not None:
        alone = np.log10(found.measured.factors)
        curves.append(Curve("isotherms, each on its own", T - ZERO_CELSIUS, alone, 1, True))
    return [
        Chart("shift", "Shift factors", "Times are longer in the cold.", "temperature (degC)",
              "log10 a_T", curves)
    ]  # fmt: skip


def _stress(case: RubberCase, found: Compound) -> list[Chart]:
    charts = []
    for name, title, path in (
        ("bar", "A bar, drawn at a constant rate: nominal stress", uniaxial),
        ("shear", "Simple shear at a constant rate", simple_shear),
    ):
        curves: list[Curve] = []
        for T in temperatures(case, found):
            for rate in case.rates:
                reduced = rate * float(found.relaxation.shift(T))
                strain, stress = at_rate(
                    found.constants, found.relaxation.prony, path, LARGEST_STRAIN, reduced
                )
                label = f"{T - ZERO_CELSIUS:.4g} degC, {rate:g} 1/s"
                curves.append(Curve(label, strain[1:], stress[1:] / 1e6, len(curves)))
        says = "Rubber is stiffer the faster and the colder it is strained."
        ends = [float(np.asarray(curve.y)[-1]) for curve in curves]
        scale = "y" if max(ends) > APART * min(ends) else ""
        charts.append(Chart(name, title, says, "strain", "stress (MPa)", curves, logarithmic=scale))
    return charts


def _command(case: RubberCase) -> str:
    words = ["iceslide", "rubber", str(Path(case.source))]
    for name, field in type(case).model_fields.items():
        value = getattr(case, name)
        if name == "source" or value == field.default:
            continue
        text = ",".join(f"{each:g}" for each in value) if isinstance(value, tuple) else value
        words += [str(field.alias), text if isinstance(text, str) else f"{text:g}"]
    return shlex.join(words)
