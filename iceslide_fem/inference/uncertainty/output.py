"""What `iceslide uncertainty` writes: uncertainty.json, samples.csv, runs.csv, and charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.inference.uncertainty.case import UncertaintyCase
from iceslide_fem.inference.uncertainty.propagate import Spread
from iceslide_fem.postprocess.report.page import Chart, Curve
from iceslide_fem.preprocess.work import csv_text
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.files import replace_file

QUANTILES = (0.025, 0.5, 0.975)
ENOUGH = 0.9  # correlation of runs and points
BINS = 40
DRAWN = 600  # samples in a chart


def known(mu: Array) -> Array:
    """Those that were computed."""
    return mu[np.isfinite(mu)]


def figures(case: UncertaintyCase, found: Spread) -> dict[str, Any]:
    """The content of uncertainty.json."""
    mu, runs = known(found.mu), found.runs
    low, middle, high = np.quantile(mu, QUANTILES)
    texts = {**case.scene.uncertainty, **case.input}
    warnings = []
    if found.samples.reasons:
        why = next(iter(found.samples.reasons.values()))
        warnings.append(
            f"{len(found.samples.reasons)} of {found.samples.mu.size} samples failed, the first "
            f"one: {why}"
        )
    of_runs: dict[str, Any] = {}
    if runs is not None:
        of_runs = {
            "runs": int(runs.mu.size),
            "correlation": runs.correlation,
            "rest": runs.rest,
            "slope": runs.slope,
            "offset": runs.offset,
        }
        if runs.correlation < ENOUGH:
            warnings.append(
                f"runs and points correlate by {runs.correlation:.3f} only: take more --runs"
            )
    return {
        "name": case.scene.name,
        "model": _level(case),
        "output": case.quantity,
        "samples": int(found.samples.mu.size),
        "failed": len(found.samples.reasons),
        "mean": float(mu.mean()),
        "std": float(mu.std()),
        "low": float(low),
        "median": float(middle),
        "high": float(high),
        "inputs": {
            name: {
                "spread": texts.get(name, "calibration"),
                "first_order": first,
                "total": total,
            }
            for name, (first, total) in found.indices.items()
        },
        "control_variate": of_runs or None,
        "warnings": warnings,
    }


def write(case: UncertaintyCase, found: Spread, out: Path) -> None:
    """Write samples.csv, and runs.csv of slices and blocks."""
    keys = case.inputs.keys
    columns = dict(zip(keys, found.samples.values.T, strict=True))
    replace_file(out / "samples.csv", csv_text(columns | {case.quantity: found.mu}))
    if found.runs is not None:
        columns = dict(zip(keys, found.runs.values.T, strict=True))
        both = {case.quantity: found.runs.mu, f"{case.quantity}_of_point": found.runs.points}
        replace_file(out / "runs.csv", csv_text(columns | both))


def charts(case: UncertaintyCase, found: Spread) -> Mapping[str, Sequence[Chart]]:
    """Charts by the names of pictures."""
    drawn: dict[str, Sequence[Chart]] = {"distribution": [_density(case, found)]}
    drawn["inputs"] = [
        _over(case, found, number, key) for number, key in enumerate(case.inputs.keys)
    ]
    if found.runs is not None:
        drawn["control"] = [_control(case, found)]
    return drawn


def _density(case: UncertaintyCase, found: Spread) -> Chart:
    mu = known(found.mu)
    density, edges = np.histogram(mu, BINS, density=True)
    x, y = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(density, 2), [0.0]])
    low, _, high = np.quantile(mu, QUANTILES)
    said = f"95 % of the samples lie between {low:.4g} and {high:.4g}."
    name = f"{case.quantity} of {case.scene.name}"
    return Chart("distribution", f"Spread of {name}", said, "mu", "density", [Curve("mu", x, y)])


def _over(case: UncertaintyCase, found: Spread, number: int, key: str) -> Chart:
    values, mu = found.samples.values[:DRAWN, number], found.mu[:DRAWN]
    unit = next((one.parameter.unit for one in case.inputs.single
                 if one.parameter.key == key), "SI")  # fmt: skip
    label = f"{key} ({unit})" if unit else key
    said = f"mu of samples over {key}; all other inputs vary, too."
    curve = Curve("samples", values, mu, 0, True)
    return Chart(f"over-{key.replace('.', '-')}", f"mu over {key}", said, label, "mu", [curve])


def _control(case: UncertaintyCase, found: Spread) -> Chart:
    runs = found.runs
    assert runs is not None
    ends = np.array([np.nanmin(runs.points), np.nanmax(runs.points)])
    curves = [
        Curve("runs", runs.points, runs.mu, 0, True),
        Curve("line", ends, runs.offset + runs.slope * ends, 1),
    ]
    said = (
        f"{runs.mu.size} runs beside points at the same inputs: correlation "
        f"{runs.correlation:.3f}, rest {runs.rest:.2g}."
    )
    level = _level(case)
    title, y = f"{level} and point", f"{case.quantity} of the {level}"
    return Chart("control", title, said, "mu of the point", y, curves)


def _level(case: UncertaintyCase) -> str:
    """What is computed: the scene's model, a wheel, or a footprint."""
    return case.kind or str(case.scene.model)
