"""Factors of a block in single and in double precision: seconds, iterations and mu(t).

Whole runs of the command, one after the other, for each scene, tolerance and number of ranks. Rows
give what single factors change: the largest difference of mu(t) and that of mean mu, relative to
the mean. --quick runs half of the refinement for a moment.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.results.run_directory import read_run
from scripts.studies.common import ROOT, options, run_words, table

CASES = {  # each with what else is changed
    "thesis_1bar": (),
    "thesis_5bar": (),
    "tread_block": ("model=block", "numerics.refinement=1.75"),
}
MOMENT = ("load.duration=0.1ms", "numerics.refinement=0.5")
TIMES = 400  # at which mu(t) is compared
PRECISION, PRECISIONS = "-rubber_pc_precision", ("double", "single")


class Found(NamedTuple):
    """A run: its summary, and mu at TIMES."""

    summary: dict[str, Any]
    mu: Array


def found(case: str, changes: Sequence[str], ranks: int, *solver: str) -> Found:
    """A run of the command with PETSc's options for the `solver`. Raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as folder:
        more = ["--no-report", *(["--", *solver] if solver else [])]
        path = ROOT / "cases" / f"{case}.toml"
        words = run_words(path, folder, *changes, "output.times=1", ranks=ranks, more=more)
        subprocess.run(words, check=True, capture_output=True)
        run = read_run(folder)
        times = np.linspace(0.0, run.history["time_s"][-1], TIMES)
        mu = np.interp(times, run.history["time_s"], run.history["mu"])
        return Found(json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8")), mu)


def moved(run: Found, exact: Found) -> tuple[str, str]:
    """Largest difference of mu(t), and that of its mean, over the mean of the `exact` one."""
    mean = exact.mu.mean()
    return f"{np.abs(run.mu - exact.mu).max() / mean:.1e}", f"{run.mu.mean() / mean - 1.0:+.1e}"


def rows(
    cases: Sequence[str], tolerances: Sequence[str], ranks: Sequence[int], moment: Sequence[str]
) -> Iterator[tuple[object, ...]]:
    """Of each case, tolerance and number of ranks, in both precisions."""
    for case, tolerance, number in product(cases, tolerances, ranks):
        changes = ("model=block", *CASES[case], f"numerics.tolerance={tolerance}", *moment)
        exact: Found | None = None
        for precision in PRECISIONS:
            run = found(case, changes, number, PRECISION, precision)
            exact = exact or run
            summary = run.summary
            yield (
                case, tolerance, number, precision, summary["dofs"], summary["steps"],
                summary["newton_iterations"], f"{summary['wall_s']:.3g}",
                f"{exact.summary['wall_s'] / summary['wall_s']:.2f}",
                *moved(run, exact),
            )  # fmt: skip


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment on coarse meshes, one rank")
    parser.add_argument("--cases", nargs="+", choices=tuple(CASES), default=tuple(CASES))
    parser.add_argument("--tolerances", nargs="+", default=["1e-2"])
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2])
    arguments = parser.parse_args()
    ranks = [1] if arguments.quick else arguments.ranks
    head = (
        "case", "tolerance", "ranks", "precision", "unknowns", "steps", "iterations", "wall s",
        "times faster", "largest of mu(t)", "of mean mu",
    )  # fmt: skip
    moment = MOMENT if arguments.quick else ()
    table(head, rows(arguments.cases, arguments.tolerances, ranks, moment))


if __name__ == "__main__":
    main()
