"""Work of `iceslide rubber`: read, fit, write; and printed figures."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.report.page import write_page
from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.compound import compound
from iceslide_fem.preprocess.rubber.figures import NAMES, draw
from iceslide_fem.preprocess.rubber.output import fragment, relaxation_table, shift_table, summary
from iceslide_fem.preprocess.rubber.report_page import page_of_rubber
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.folders import claimed, clear_results, other_case
from iceslide_fem.runtime.units import ZERO_CELSIUS

WRITTEN = (
    "rubber.toml",
    "rubber.csv",
    "shift_factors.csv",
    "rubber.json",
    *(f"{name}.png" for name in NAMES),
    "report.html",
)


def run(values: Mapping[str, Any], out: Path, force: bool = False) -> dict[str, Any]:
    """Characterise the rubber that `values` describe (see `RubberCase`), and write to `out`.

    Writes the files in `WRITTEN` and returns the content of rubber.json. Earlier results of the
    same rubber are replaced, with `force` any results. Raises SceneError, before anything is
    written, if the input is invalid or `out` must not be used, and OutputError if a file cannot be
    written.
    """
    begun = time.perf_counter()
    case = RubberCase.of(values)
    here = case.model_dump(mode="json")
    with claimed(out, partial(other_case, "rubber.json", here), force, case.files):
        found = compound(case)
        figures = summary(case, found)
        texts = {
            "rubber.toml": fragment(found),
            "rubber.csv": relaxation_table(found),
            "shift_factors.csv": shift_table(found),
        }
        with writing(out):
            clear_results(out)
            draw(case, found, out)
        for name, text in texts.items():
            replace_file(out / name, text)
        figures["wall_s"] = time.perf_counter() - begun
        replace_file(out / "rubber.json", json.dumps(figures, indent=2) + "\n")
        write_page(out / "report.html", page_of_rubber(case, found, figures, lines(figures)))
        return figures


def lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The main figures of the rubber as names and readable values."""
    of, measured = figures["moduli_of"], figures.get("measured")
    low, high = (value / 6.283185307179586 for value in figures["reduced_frequencies_rad_per_s"])
    arms = len(figures["prony"])
    result = [
        ("rubber", figures["name"]),
        ("arms", str(arms)),
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
            f"{measured['largest_at_Hz']:.4g} Hz, "
            f"{measured['largest_at_K'] - ZERO_CELSIUS:.4g} degC",
        )
    )
    if "isotherms_off_law_decades" in measured:
        off = measured["isotherms_off_law_decades"]
        result.append(("isotherms off the law", f"up to {off:.2g} decades"))
    return result
