"""Text output of `iceslide rubber`: a `[rubber]` table for scenes, tables, a summary."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.compound import Compound
from iceslide_fem.preprocess.work import csv_text
from iceslide_fem.relaxation.doubts import of_fit
from iceslide_fem.relaxation.shift import Shift, ShiftTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS

PER_DECADE = 10  # rows of the relaxation
UNSEEN = 0.05  # fraction of a modulus beyond the measured frequencies that gives a warning


def fragment(found: Compound) -> str:
    """The text of rubber.toml with a viscoelastic `[rubber]`."""
    g, tau = found.relaxation.prony.fractions, found.relaxation.prony.times
    reference = found.reference
    lines = [
        f"# Rubber that relaxes: {found.name}. Written by iceslide rubber.",
        "# Paste it into a scene in place of the compound or the constants of its [rubber].",
        "[rubber]",
    ]
    for key, (value, remark) in found.keys.items():
        text = json.dumps(value) if isinstance(value, str) else f"{value:.7g}"
        lines.append(f"{key} = {text}" + (f"  # {remark}" if remark else ""))
    lines.append(f'modulus_is = "{found.modulus_is}"  # of the compound, or C10 and C01')
    at = "" if reference is None else f" at {reference - ZERO_CELSIUS:.6g} degC"
    lines.append(f"# [g, tau]: fractions of the instantaneous modulus, times in s{at}")
    lines.append("prony = [")
    lines += [f"    [{arm:.9g}, {time:.7g}]," for arm, time in zip(g, tau, strict=True)]
    lines.append("]")
    shift = found.relaxation.shift
    if isinstance(shift, Shift):
        lines += [
            "# log10 a_T = -C1 (T - reference) / (C2 + T - reference), C2 in K",
            _wlf(shift, found.relaxation.measured),
        ]
    elif isinstance(shift, ShiftTable):
        rows = ", ".join(f"[{T:.7g}, {log:.7g}]" for T, log in shift.rows)
        lines += ["# rows of T in K, log10 a_T", f"shift_factors = [{rows}]"]
    return "\n".join(lines) + "\n"


def _wlf(shift: Shift, measured: tuple[float, float] | None) -> str:
    keys = {
        "C1": f"{shift.C1:.7g}",
        "C2": f"{shift.C2:.7g}",
        "reference": f"{shift.reference:.7g}",
    }
    if shift.activation_energy:
        keys["arrhenius_below"] = f"{shift.arrhenius_below:.7g}"
        keys["activation_energy"] = f"{shift.activation_energy:.7g}"
    if measured is not None:
        keys["measured"] = f"[{measured[0]:.7g}, {measured[1]:.7g}]"
    return "wlf = { " + ", ".join(f"{key} = {value}" for key, value in keys.items()) + " }"


def relaxation_columns(found: Compound) -> dict[str, Array]:
    """Columns of rubber.csv: moduli over time, and dynamic moduli at the inverse frequency."""
    low, high = found.frequencies
    rows = 1 + round(PER_DECADE * float(np.log10(high / low)))
    times = np.geomspace(1.0 / high, 1.0 / low, rows)
    prony = found.relaxation.prony
    dynamic = found.modulus * prony.dynamic(1.0 / times)
    columns = [times, found.modulus * prony.modulus(times), dynamic.real, dynamic.imag]
    of = found.of
    head = ("time_s", f"{of}_Pa", f"{of}_storage_Pa", f"{of}_loss_Pa")
    return dict(zip(head, columns, strict=True))


def relaxation_table(found: Compound) -> str:
    """The text of rubber.csv."""
    return csv_text(relaxation_columns(found), 6)


def shift_table(found: Compound) -> str:
    """The text of shift_factors.csv; for a scene over the temperatures of its shift."""
    shift, measured = found.relaxation.shift, found.measured
    temperatures = found.isotherms
    if measured is None:
        reference = found.reference or 293.15
        temperatures = reference + np.arange(-60.0, 61.0, 5.0)
        temperatures = temperatures[np.isfinite(shift(temperatures))]
    law = np.log10(shift(temperatures))
    columns = {"temperature_C": temperatures - ZERO_CELSIUS, "log10_a_T": law}
    if measured is not None and measured.factors is not None:
        columns["log10_a_T_alone"] = np.log10(measured.factors)
    return csv_text(columns, 6)


def summary(case: RubberCase, found: Compound) -> dict[str, Any]:
    """All data of the rubber for rubber.json; SI units as in the names."""
    prony, shift, measured = found.relaxation.prony, found.relaxation.shift, found.measured
    low, high = found.frequencies
    result: dict[str, Any] = {
        "name": found.name,
        "moduli_of": found.of,
        "instantaneous_modulus_Pa": found.modulus,
        "long_term_modulus_Pa": found.modulus * prony.long_term,
        "prony": [list(arm) for arm in zip(prony.fractions, prony.times, strict=True)],
        "modulus_is": found.modulus_is,
        "shift": shift.words,
        "wlf": None,
        "shift_factors": shift.rows if isinstance(shift, ShiftTable) else None,
        "reduced_frequencies_rad_per_s": [low, high],
        "warnings": warnings(found),
        "toml": fragment(found),
    }
    if isinstance(shift, Shift):
        result["wlf"] = {"C1": shift.C1, "C2_K": shift.C2, "reference_K": shift.reference}
        if shift.activation_energy:
            result["wlf"] |= {
                "arrhenius_below_K": shift.arrhenius_below,
                "activation_energy_J_per_mol": shift.activation_energy,
            }
    if measured is not None:
        off, dma = measured.misfit, measured.dma
        result["measured"] = {
            "rows": len(dma.frequency),
            "isotherms_K": found.isotherms.tolist(),
            "rms_ln_storage": off.storage,
            "rms_ln_tan_delta": off.tan_delta,
            "largest_ln": off.largest,
            "largest_of": off.quantity,
            "largest_at_Hz": float(dma.frequency[off.row] / (2.0 * np.pi)),
            "largest_at_K": float(dma.temperature[off.row]),
        }
        if measured.factors is not None:
            decades = np.log10(measured.factors / shift(found.isotherms))
            result["measured"]["isotherms_off_law_decades"] = float(np.abs(decades).max())
    return result


def warnings(found: Compound) -> list[str]:
    """Warnings on the table, the fit, and the use of the series."""
    measured, prony = found.measured, found.relaxation.prony
    if measured is None:
        return []
    result = of_fit(measured)
    if found.of_is_assumed:
        result.append(
            "headings do not say whether moduli are Young's (E) or shear moduli (G): they are "
            "taken as E. For those of a rotational rheometer give --of G: C10 is then three times "
            "as large"
        )
    low, high = found.frequencies
    g, tau = np.array(prony.fractions), np.array(prony.times)
    fast, slow = g[tau * high < 1.0].sum(), g[tau * low > 1.0].sum()
    if fast > UNSEEN:
        result.append(
            f"{100 * fast:.0f} % of the instantaneous modulus relax faster than the highest "
            "measured frequency: this modulus is extrapolated"
        )
    if measured.flows or slow > UNSEEN * prony.long_term:
        result.append(
            "the lowest frequency does not reach the long-term modulus: it is extrapolated"
        )
    return result
