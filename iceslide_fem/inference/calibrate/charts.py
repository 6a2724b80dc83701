"""Charts of a calibration: measured beside computed, profiles, residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from iceslide_fem.inference.calibrate.case import CalibrateCase
from iceslide_fem.inference.calibrate.output import Calibration
from iceslide_fem.postprocess.report.page import Chart, Curve
from iceslide_fem.runtime.units import ZERO_CELSIUS

LOADS = {
    "speed": ("speed (m/s)", 1.0, 0.0, "xy"),
    "pressure": ("pressure (bar)", 1e-5, 0.0, "y"),
    "temperature": ("ice temperature (°C)", 1.0, ZERO_CELSIUS, "y"),
    "duration": ("duration (ms)", 1e3, 0.0, "xy"),
}


def charts(case: CalibrateCase, found: Calibration) -> Mapping[str, Sequence[Chart]]:
    """Charts by the names of pictures."""
    return {"measured": _measured(found), "profiles": _profiles(found), "residuals": _rest(found)}


def _measured(found: Calibration) -> list[Chart]:
    """mu over each varied load, measured and computed."""
    problem = found.problem
    row, measured, computed = problem.row_of_value, problem.mu_measured, found.mu_computed
    if (series := problem.measured.series) is not None:
        there = np.isfinite(series.mu)
        curves = []
        for number in range(problem.measured.number):
            own, time = row == number, 1e3 * series.times[there[number]]
            curves += [
                Curve(f"row {number + 1}, measured", time, measured[own], number, True),
                Curve(f"row {number + 1}, computed", time, computed[own], number),
            ]
        said = "Measured friction and that of the fitted parameters."
        return [Chart("series", "mu over time", said, "time (ms)", "mu", curves)]
    loads, result = problem.measured.rows.of(problem.scene), []
    given = problem.measured.varied
    for name in [one for one in given if np.ptp(loads[one]) > 0.0] or given:
        label, factor, zero, scale = LOADS[name]
        x = factor * (loads[name][row] - zero)
        curves = [
            Curve("measured", x, measured, 0, True),
            Curve("computed", x, computed, 1, True),
        ]
        said = "Measured friction and that of the fitted parameters, row by row."
        result.append(Chart(f"over-{name}", f"mu over {name}", said, label, "mu", curves,
                            logarithmic=scale))  # fmt: skip
    return result


def _profiles(found: Calibration) -> list[Chart]:
    """By how much the fit gets worse as one parameter is held elsewhere."""
    problem, fit, _ = found
    result = []
    for one, interval, z in zip(problem.parameters, fit.intervals, fit.best.z, strict=True):
        at, squares = interval.profile.T
        rise = np.sqrt(np.maximum(squares - fit.best.squares, 0.0) / fit.variance)
        curve = Curve("profile", np.exp(at), np.sign(at - z) * rise)
        ends = [
            f"{np.exp(end):.4g}" if np.isfinite(end) else "open"
            for end in (interval.low, interval.high)
        ]
        said = (
            f"Signed root of the rise of the sum of squares over the variance. A straight line "
            f"over ln p is a normal error. The interval is {ends[0]} to {ends[1]} {one.unit}."
        )
        unit = f" ({one.unit})" if one.unit else ""
        result.append(
            Chart(f"profile-{one.key.replace('.', '-')}", f"Profile of {one.key}", said,
                  f"{one.key}{unit}", "rise (standard errors)", [curve])
        )  # fmt: skip
    return result


def _rest(found: Calibration) -> list[Chart]:
    """Residuals of the fit, and of fits without the row."""
    problem, fit, left_out = found
    scale, row = problem.scale, problem.row_of_value + 1
    curves = [
        Curve("fit of all rows", row, 100.0 * np.expm1(fit.best.residuals * scale), 0, True),
        Curve("fit without the row", row, 100.0 * np.expm1(left_out * scale), 1, True),
    ]
    said = "Computed over measured friction. Without the row: what the model predicts of it."
    return [Chart("rest", "Residuals", said, "row", "computed / measured - 1 (%)", curves)]
