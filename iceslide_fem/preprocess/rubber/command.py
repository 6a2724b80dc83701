"""`iceslide rubber`: read, fit, write; and words about it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.postprocess.report.page import Cell, Section, Table, Text
from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.charts import charts
from iceslide_fem.preprocess.rubber.compound import Compound, compound
from iceslide_fem.preprocess.rubber.output import fragment, relaxation_table, shift_table, summary
from iceslide_fem.preprocess.work import Preprocessor, Words
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.units import ZERO_CELSIUS, celsius

FRAGMENT = "rubber.toml"
LEFT_OUT = (
    "Moduli are those of one small amplitude: no Payne effect, no softening by earlier strains. "
    "Volume changes are elastic, and moduli are not shifted vertically "
    '(page "Rubber that relaxes").'
)


def write(case: RubberCase, found: Compound, out: Path) -> None:
    """Write rubber.toml, rubber.csv and shift_factors.csv."""
    replace_file(out / FRAGMENT, fragment(found))
    replace_file(out / "rubber.csv", relaxation_table(found))
    replace_file(out / "shift_factors.csv", shift_table(found))


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of a compound."""
    arms = [[Cell(f"{tau:.4g}"), Cell(f"{g:.5g}")] for g, tau in figures["prony"]]
    head = ["tau (s)", "g of the instantaneous modulus"]
    kind = "Young's" if figures["moduli_of"] == "E" else "shear"
    return Words(
        title=f"{figures['name']}: rubber that relaxes",
        summary=f"{len(arms)} arms, from {figures['instantaneous_modulus_Pa'] / 1e6:.4g} MPa at "
        f"once to {figures['long_term_modulus_Pa'] / 1e6:.4g} MPa in the end ({kind} modulus).",
        lines=_lines(figures),
        left_out=LEFT_OUT,
        more=[
            Section("arms", "Arms", [Table("The Prony series", head, arms)]),
            Section("use", "Use it in a scene", [Text(figures["toml"], "code")]),
        ],
    )


def _lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    of, measured = figures["moduli_of"], figures.get("measured")
    low, high = (value / (2.0 * np.pi) for value in figures["reduced_frequencies_rad_per_s"])
    result = [
        ("rubber", figures["name"]),
        ("arms", str(len(figures["prony"]))),
        (f"{of}, instantaneous", f"{figures['instantaneous_modulus_Pa'] / 1e6:.4g} MPa"),
        (f"{of}, long-term", f"{figures['long_term_modulus_Pa'] / 1e6:.4g} MPa"),
        ("reduced frequencies", f"{low:.3g} to {high:.3g} Hz"),
        ("shift", figures["shift"]),
    ]
    if measured is not None:
        result += _fit_lines(of, measured)
    return [*result, ("seconds", f"{figures['wall_s']:.1f}")]


def _fit_lines(of: str, measured: Mapping[str, Any]) -> list[tuple[str, str]]:
    isotherms = [T - ZERO_CELSIUS for T in measured["isotherms_K"]]
    span = f"{isotherms[0]:.4g}"
    if len(isotherms) > 1:
        span = f"{len(isotherms)} from {span} to {isotherms[-1]:.4g}"
    result = [
        ("rows", str(measured["rows"])),
        ("isotherms", f"{span} degC"),
    ]
    if (tan_delta := measured["rms_ln_tan_delta"]) is None:
        result.append((f"rms of ln {of}(t)", f"{measured['rms_ln_storage']:.3g}"))
    else:
        result += [
            (f"rms of ln {of}'", f"{measured['rms_ln_storage']:.3g}"),
            ("rms of ln tan delta", f"{tan_delta:.3g}"),
        ]
    result.append(
        (
            "largest deviation",
            f"{measured['largest_ln']:+.3g} of ln {measured['largest_of']}, "
            f"{measured['largest_at_Hz']:.4g} Hz, {celsius(measured['largest_at_K'])}",
        )
    )
    if "isotherms_off_law_decades" in measured:
        off = measured["isotherms_off_law_decades"]
        result.append(("isotherms off the law", f"up to {off:.2g} decades"))
    return result


RUBBER = Preprocessor(
    "rubber", RubberCase, compound, summary, write, charts, words, summary="rubber.json"
)
