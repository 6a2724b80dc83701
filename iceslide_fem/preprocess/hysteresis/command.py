"""`iceslide hysteresis`: compute, write; and words about it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.report.page import Cell, Table
from iceslide_fem.preprocess.hysteresis.case import HysteresisCase
from iceslide_fem.preprocess.hysteresis.charts import charts
from iceslide_fem.preprocess.hysteresis.survey import (
    Found,
    columns,
    figures,
    spectrum_columns,
    survey,
)
from iceslide_fem.preprocess.work import Preprocessor, Words, csv_text
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.units import celsius
from iceslide_fem.scene.materials import BAR

LEFT_OUT = (
    "The ice is rigid: its asperities neither melt nor break, so mu_h is an upper bound. The rubber"
    " is linear, incompressible, and as warm as at the start: flash temperature is left out. Waves "
    "shorter than the shortest one are left out; where they end is not known."
)


def write(case: HysteresisCase, found: Found, out: Path) -> None:
    """Write hysteresis.csv and waves.csv."""
    replace_file(out / "hysteresis.csv", csv_text(columns(found)))
    replace_file(out / "waves.csv", csv_text(spectrum_columns(found)))


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say."""
    ice, mu = figures["roughness"], figures["mu_hysteresis"]
    at = (
        f"{figures['speed_m_s']:.4g} m/s, {celsius(figures['temperature_K'])}, "
        f"{figures['pressure_Pa'] / BAR:.3g} bar"
    )
    rows = [
        [Cell(f"{1e6 * one['shortest']:.3g}"), Cell(f"{one['mu']:.3g}"),
         Cell(f"{one['contact_fraction']:.3g}")]
        for one in figures["cut_offs"]
    ]  # fmt: skip
    head = ["shortest wave (um)", "mu_h", "fraction in contact"]
    return Words(
        title=f"{figures['name']}: hysteresis on rough ice",
        summary=f"Hysteresis gives mu {mu:.3g} at {at}. It adds to the friction of film and dry "
        "contact.",
        lines=[
            ("at", at),
            ("mu_h", f"{mu:.4g}"),
            ("fraction in contact", f"{figures['contact_fraction']:.3g}"),
            ("rms height", f"{1e6 * ice['rms_m']:.3g} um"),
            ("rms slope", f"{ice['rms_slope']:.3g}"),
            ("waves", f"{1e6 * ice['longest_m']:.4g} to {1e6 * ice['shortest_m']:.4g} um"),
            ("seconds", f"{figures['wall_s']:.1f}"),
        ],
        left_out=LEFT_OUT,
        tables=[Table("What the shortest wave does", head, rows)],
    )


HYSTERESIS = Preprocessor(
    "hysteresis", HysteresisCase, survey, figures, write, charts, words, ending="_hysteresis"
)
