"""What a calibration writes: calibration.json, residuals.csv, and lines for a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.inference.calibrate.case import CalibrateCase
from iceslide_fem.inference.calibrate.fit import AT_BOUND, Fit, undetermined
from iceslide_fem.inference.calibrate.problem import Problem
from iceslide_fem.preprocess.work import csv_text
from iceslide_fem.runs.many_points import KEYS
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import as_toml, put
from iceslide_fem.scene.fields import with_unit

UNKNOWN = 1e8  # variance of ln p of a parameter without effect
LARGE = 0.3  # root mean square of ln mu, above which a model does not describe data
DIGITS = 5  # of fitted values
NO_EFFECT = 1e-4  # change of ln mu by a change of ln p, root mean square
FEW_TIMES = 2.0  # residuals whose spread is so many times what sigma says


class Calibration(NamedTuple):
    """A finished calibration; left_out: residuals (values,) of rows under fits without them."""

    problem: Problem
    fit: Fit
    left_out: Array

    @property
    def mu_computed(self) -> Array:
        """mu of the fit, (values,)."""
        return self.problem.mu(self.fit.best.residuals)

    @property
    def mu_left_out(self) -> Array:
        """The same of fits without the row, (values,)."""
        return self.problem.mu(self.left_out)


def figures(case: CalibrateCase, found: Calibration) -> dict[str, Any]:
    """The content of calibration.json."""
    problem, fit, left_out = found
    names = [one.key for one in problem.parameters]
    return {
        "name": f"{case.source.stem}",
        "scene": problem.scene.name,
        "output": case.output,
        "rows": problem.measured.number,
        "level": case.level,
        "parameters": {
            one.key: {
                "estimate": float(np.exp(z)),
                "low": _end(interval.low),
                "high": _end(interval.high),
                "unit": one.unit,
                "standard_error_of_ln": float(np.sqrt(error)) if error < UNKNOWN else None,
                "bounds": [one.low, one.high],
            }
            for one, z, interval, error in zip(
                problem.parameters, fit.best.z, fit.intervals, np.diag(fit.covariance), strict=True
            )
        },
        "covariance_of_ln": fit.covariance.tolist(),
        "singular_values": fit.singular.tolist(),
        "sum_of_squares_of_ln": float(((fit.best.residuals * problem.scale) ** 2).sum()),
        "rms_ln_mu": rms(fit.best.residuals * problem.scale),
        "rms_ln_mu_left_out": rms(left_out * problem.scale),
        "sigma": float(np.sqrt(fit.variance) * np.median(problem.measured.sigma)),
        "points": problem.points,
        "toml": snippet(found),
        "determined": _determined(found),
        "warnings": _warnings(names, found),
    }


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def _end(z: float) -> float | None:
    return None if np.isnan(z) else float(np.exp(z))


def _determined(found: Calibration) -> list[str]:
    """What the data do not determine, in words."""
    said = []
    for parts, exponents, error in undetermined(found.fit):
        names = [found.problem.parameters[part].key for part in parts]
        factor = np.exp(min(error, np.log(1e6)))
        if len(parts) == 1:
            said.append(
                f"{names[0]} is not determined (its standard error is a factor of {factor:.2g})"
            )
            continue
        first = exponents / exponents[np.argmax(np.abs(exponents))]
        free = " and ".join(names)
        if len(parts) == 2:
            ratio = -first[1] / first[0]
            power = f"^{abs(1.0 / ratio):.2g}" if abs(abs(ratio) - 1.0) > 0.1 else ""
            between = f"{names[0]} {'/' if ratio < 0 else '*'} {names[1]}{power}"
            said.append(
                f"{free} are not determined apart from each other (along their direction the "
                f"standard error is a factor of {factor:.2g}): only {between} is"
            )
        else:
            said.append(
                f"{free} are not determined apart from each other (a factor of {factor:.2g})"
            )
    return said


def _warnings(names: list[str], found: Calibration) -> list[str]:
    problem, fit, _ = found
    said = []
    width = problem.high - problem.low
    for number, name in enumerate(names):
        z = fit.best.z[number]
        for bound, ends in ((problem.low, "lower"), (problem.high, "upper")):
            if abs(z - bound[number]) < AT_BOUND * width[number]:
                value = with_unit(float(np.exp(bound[number])), problem.parameters[number].unit)
                said.append(f"{name} is at its {ends} bound, {value}: the best value lies beyond")
        effect = rms(fit.best.slope[:, number] * problem.scale)
        if effect < NO_EFFECT:
            said.append(f"{name} has no effect on these data: it is not determined")
        interval = fit.intervals[number]
        for end, side in ((interval.low, "lower"), (interval.high, "upper")):
            if np.isnan(end):
                said.append(
                    f"the profile of {name} does not close towards its {side} bound: the data do "
                    "not limit it there"
                )
    off = rms(fit.best.residuals * problem.scale)
    if off > LARGE:
        said.append(
            f"computed mu is off by a factor of {np.exp(off):.2g} (rms): the model does "
            "not describe these data"
        )
    if fit.other is not None:
        values = problem.values(fit.other)
        where = ", ".join(f"{key} = {value:.3g}" for key, value in values.items())
        said.append(f"the data fit as well elsewhere, at {where}: another start ended there")
    if problem.measured.known:
        over = fit.best.squares / max(fit.best.residuals.size - len(names), 1)
        if over > FEW_TIMES**2:
            said.append(
                f"residuals are {np.sqrt(over):.2g} times as large as their sigma: the model does "
                "not describe the data to their noise, and the intervals are too narrow"
            )
    return said


def snippet(found: Calibration) -> str:
    """The fitted values as lines of a scene."""
    tables: dict[str, Any] = {}
    for one, z in zip(found.problem.parameters, found.fit.best.z, strict=True):
        value = float(f"{np.exp(z):.{DIGITS}g}")
        put(tables, one.key, with_unit(value, one.unit, DIGITS) if one.unit else value)
    return as_toml(tables)


def write(case: CalibrateCase, found: Calibration, out: Path) -> None:
    """Write residuals.csv and snippet.toml."""
    problem, fit, left_out = found
    row = problem.row_of_value
    loads = problem.measured.rows.of(problem.scene)
    names = {"speed": "speed_m_per_s", "pressure": "pressure_Pa", "temperature": "temperature_C",
             "duration": "duration_s"}  # fmt: skip
    columns: dict[str, Any] = {"row": row + 1}
    for name in KEYS:
        shift = ZERO_CELSIUS if name == "temperature" else 0.0
        columns[names[name]] = loads[name][row] - shift
    measured, scale = problem.mu_measured, problem.scale
    columns |= {
        "mu_measured": measured,
        "mu_computed": found.mu_computed,
        "mu_left_out": found.mu_left_out,
        "residual_ln": fit.best.residuals * scale,
        "residual_ln_left_out": left_out * scale,
        "sigma_mu": problem.measured.sigma[row] * measured,
    }
    if (series := problem.measured.series) is not None:
        columns["time_s"] = series.times[np.nonzero(np.isfinite(series.mu))[1]]
    replace_file(out / "residuals.csv", csv_text(columns))
    replace_file(out / "snippet.toml", snippet(found))
