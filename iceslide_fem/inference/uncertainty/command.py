"""`iceslide uncertainty`: draw, compute, write; and words about it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.inference.uncertainty.case import UncertaintyCase
from iceslide_fem.inference.uncertainty.output import charts, figures, write
from iceslide_fem.inference.uncertainty.propagate import Spread, spread_of_points, spread_of_runs
from iceslide_fem.inference.uncertainty.tyres import run_tyres
from iceslide_fem.postprocess.report.page import Cell, Table
from iceslide_fem.preprocess.work import Preprocessor, Words
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.sweep.processes import compute_all
from iceslide_fem.workflow.sweep.table import DONE

LEFT_OUT = (
    "Inputs that are not named are taken as exact, and so is the model. Inputs of --input are "
    "independent; parameters of a calibration are not (page "
    '"Parameters from data, and what doubt means").'
)
HEAD = ("input", "spread", "alone", "with all others")


def compute(case: UncertaintyCase) -> Spread:
    """The spread of a case. Raises SceneError, SimulationStopped."""
    scene, inputs, tyre = case.scene, case.inputs, case.tyre
    if tyre is None and scene.model == "point":
        return spread_of_points(scene, inputs, case.samples, case.quantity)

    def run_all(scenes: Sequence[Scene], folder: Path) -> Array:
        named = {f"run{number}": one for number, one in enumerate(scenes, start=1)}
        outcomes = compute_all(folder, named).values()
        done = (one.summary[case.quantity] if one.status == DONE else np.nan for one in outcomes)
        return np.array(list(done))

    run: Callable[[Sequence[Scene], Path], Array] = run_all
    of_points = case.quantity
    if tyre is not None:
        run, of_points = partial(run_tyres, tyre), "mu_mean"
    with tempfile.TemporaryDirectory() as folder:
        return spread_of_runs(scene, inputs, case.runs, of_points, run, Path(folder))


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of the spread."""
    rows = [
        [Cell(key), Cell(one["spread"]), Cell(f"{one['first_order']:.0%}"),
         Cell(f"{one['total']:.0%}")]
        for key, one in figures["inputs"].items()
    ]  # fmt: skip
    said = (
        f"{figures['output']} of {figures['name']} is {figures['mean']:.4g} with a standard "
        f"deviation of {figures['std']:.2g}; 95 % lie between {figures['low']:.4g} and "
        f"{figures['high']:.4g}."
    )
    lines = [
        ("mean", f"{figures['mean']:.6g}"),
        ("standard deviation", f"{figures['std']:.4g}"),
        (
            "2.5 %, median, 97.5 %",
            ", ".join(f"{figures[q]:.6g}" for q in ("low", "median", "high")),
        ),
        ("samples", f"{figures['samples']}, {figures['failed']} failed"),
    ]
    if (control := figures["control_variate"]) is not None:
        lines.append(
            (
                f"{control['runs']} runs",
                f"correlation with points {control['correlation']:.4f}, rest {control['rest']:.2g}",
            )
        )
    return Words(
        title=f"{figures['name']}: what uncertain inputs mean for mu",
        summary=said,
        lines=[*lines, ("seconds", f"{figures['wall_s']:.1f}")],
        left_out=LEFT_OUT,
        tables=[Table("Parts of the variance of mu (Sobol indices)", HEAD, rows)],
        remarks=[said],
    )


UNCERTAINTY = Preprocessor(
    "uncertainty", UncertaintyCase, compute, figures, write, charts, words,
    summary="uncertainty.json", ending="_uncertainty",
)  # fmt: skip
