"""`iceslide calibrate`: read, fit, write; and words about it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from iceslide_fem.inference.calibrate.case import CalibrateCase
from iceslide_fem.inference.calibrate.charts import charts
from iceslide_fem.inference.calibrate.fit import fit, leave_one_out
from iceslide_fem.inference.calibrate.output import Calibration, figures, write
from iceslide_fem.inference.calibrate.problem import Problem
from iceslide_fem.postprocess.report.page import Cell, Section, Table, Text
from iceslide_fem.preprocess.work import Preprocessor, Words
from iceslide_fem.scene.fields import with_unit

LEFT_OUT = (
    "The point level: uniform pressure, no block, no edges. Errors of the measured loads are not "
    "among the residuals, and rows are taken as independent (page "
    '"Parameters from data, and what doubt means").'
)
HEAD = ("parameter", "estimate", "from", "to", "error of ln")


def compute(case: CalibrateCase) -> Calibration:
    """The calibration of a case. Raises SceneError, SimulationStopped."""
    parameters = tuple(case.parameters)
    problem = Problem(case.point, case.measured, parameters, case.output)
    found = fit(problem, case.level)
    return Calibration(problem, found, leave_one_out(problem, found.best))


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of a calibration."""
    rows = [_row(key, one) for key, one in figures["parameters"].items()]
    rest, unseen = figures["rms_ln_mu"], figures["rms_ln_mu_left_out"]
    holds = (
        f"The fitted model describes the {figures['rows']} rows with {rest:.1%} (root mean square "
        f"of ln mu), and rows that it has not seen with {unseen:.1%}."
    )
    return Words(
        title=f"{figures['name']}: parameters of {figures['scene']}",
        summary=holds,
        lines=[
            ("rows", str(figures["rows"])),
            ("rms of ln mu", f"{rest:.4g}"),
            ("rms of ln mu, row left out", f"{unseen:.4g}"),
            ("sum of squares of ln mu", f"{figures['sum_of_squares_of_ln']:.6g}"),
            ("singular values", ", ".join(f"{one:.3g}" for one in figures["singular_values"])),
            ("points computed", str(figures["points"])),
            ("seconds", f"{figures['wall_s']:.1f}"),
        ],
        left_out=LEFT_OUT,
        tables=[Table(f"Parameters, {figures['level']:.0%} intervals by profiles", HEAD, rows)],
        remarks=[holds, *(f"{line}." for line in figures["determined"])],
        more=[Section("use", "Use it in a scene", [Text(figures["toml"], "code")])],
    )


def _row(key: str, one: Mapping[str, Any]) -> list[Cell]:
    said = [
        "open" if one[name] is None else with_unit(float(f"{one[name]:.4g}"), one["unit"], 4)
        for name in ("estimate", "low", "high")
    ]
    error = one["standard_error_of_ln"]
    return [Cell(key), *map(Cell, said), Cell("open" if error is None else f"{error:.3g}")]


CALIBRATE = Preprocessor(
    "calibrate", CalibrateCase, compute, figures, write, charts, words,
    summary="calibration.json", ending="_calibration",
)  # fmt: skip
