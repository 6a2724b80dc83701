"""`iceslide compare`: read, compute, write; and words about it."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from iceslide_fem.inference.compare.case import CompareCase
from iceslide_fem.inference.compare.output import Comparison, charts, figures, write
from iceslide_fem.inference.compare.values import values_of_scenes, values_of_wheels
from iceslide_fem.postprocess.report.page import Cell, Section, Table, Text
from iceslide_fem.preprocess.work import Preprocessor, Words
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.terminal import LongTask

HEAD = ("condition", "candidate", "value", "over the reference", "steps and mesh", "inputs", "")
LEFT_OUT = (
    "Errors of the model, and of inputs that candidates share, are the same in both and mostly "
    "cancel in a ratio; what the model leaves out of one candidate alone does not. Steps and mesh: "
    "by how much the ratio moves when all is computed with twice the tolerance and coarser meshes "
    "and tables. Inputs: 95 % of normal ones, to first order. ISO 19447 and UN R117 ask for tests "
    'of tyres; these are computed (page "Compare compounds, patterns and tyres").'
)


def compute(case: CompareCase) -> Comparison:
    """The values of all candidates. Raises SceneError, SimulationStopped."""
    grid, inputs, output = case.all_of, case.inputs, case.quantity
    folder: Path | None = None
    with ExitStack() as undo, LongTask(1.0) as shown:
        if case.kind == "scenes":
            folder = Path(tempfile.mkdtemp(prefix="compare-"))
            undo.callback(shutil.rmtree, folder, ignore_errors=True)
            values = values_of_scenes(grid, case.run_names, inputs, output, folder)
        else:
            maps = [one.footprint() for one in case.candidates]
            values = values_of_wheels(grid, maps, inputs, output, shown.show)
        found = Comparison(case, values, folder)
        if not any(found.ratios(number) for number in range(1, len(found.names))):
            raise SimulationStopped(f"nothing could be compared: {values.failures[0]}")
        undo.pop_all()  # the runs are moved where they belong
        return found


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of the comparison."""
    rows = [
        [Cell(text) for text in _row(place["name"], name, one)]
        for place in figures["conditions"]
        for name, one in place["candidates"].items()
    ]
    names = list(figures["conditions"][0]["candidates"])
    different = [
        [Cell(key), *(Cell("–" if value is None else _short(value)) for value in values)]
        for key, values in figures["different"].items()
    ]
    what = Table("In what they differ, SI units", ["key", *names], different)
    return Words(
        title=f"{', '.join(names[1:])} against {names[0]}",
        summary=" ".join(figures["sentences"]),
        lines=[("compared", figures["output"]), ("seconds", f"{figures['wall_s']:.1f}")],
        left_out=LEFT_OUT,
        tables=[what, Table(f"{figures['output']} of all", HEAD, rows)],
        remarks=[*figures["sentences"], *(f"{said}." for said in figures["rules"])],
        more=_pages(figures),
    )


def _pages(figures: Mapping[str, Any]) -> list[Section]:
    """How to see the fields of runs side by side."""
    if not figures["runs"]:
        return []
    folders = " ".join(f"DIR/cases/{run}" for run in figures["runs"][0])
    parts = [
        Text("A page with curves and fields of the runs of one condition side by side:"),
        Text(f"iceslide report {folders}", "code"),
    ]
    return [Section("runs", "The runs", parts)]


def _row(condition: str, name: str, one: Mapping[str, Any]) -> list[str]:
    def part(key: str, of: str) -> str:
        return "not asked" if one[key] is None else f"± {100 * one[key] / one[of]:.2g} %"

    if one["ratio"] is None:
        return [condition, name, "not computed", "", "", "", ""]
    verdict = "" if one["verdict"] == "reference" else one["verdict"]
    of = ("value", "value") if not verdict else ("ratio", "ratio")
    bands = [part(f"{of[0]}_{kind}", of[1]) for kind in ("numerical", "inputs")]
    return [condition, name, f"{one['value']:.4f}", f"{one['ratio']:.4f}", *bands, verdict]


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


COMPARE = Preprocessor(
    "compare", CompareCase, compute, figures, write, charts, words,
    summary="compare.json", ending="_comparison",
)  # fmt: skip
