"""mu(t) of the cases by this package and by that of another tree: what a change of it moves.

Every case runs as a slice, with `--blocks` as a block instead, at a tolerance of 1e-2. Differences
are relative to the mean of mu: of mu(t), the largest, and of its mean. `--quick` compares a moment
of one case with itself.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import SceneError
from iceslide_fem.results import Run, read_run
from scripts.studies.common import ROOT, case, options, run_words, table

HEAD = ("case", "steps", "there", "s", "there", "largest of mu(t)", "of mean mu")
MOMENTS = 400  # at which mu(t) is compared
TOLERANCE = "numerics.tolerance=1e-2"


def sliding_cases() -> list[str]:
    """Names of the cases that are more than a point."""
    files = sorted((ROOT / "cases").glob("*.toml"))
    return [file.stem for file in files if case(file.stem).model != "point"]


def made(tree: Path, name: str, out: Path, changes: Sequence[str]) -> Run | None:
    """The run of a case by the package of `tree`; None where it cannot be made."""
    words = run_words(ROOT / "cases" / f"{name}.toml", out, *changes, more=["--no-report"])
    paths = os.environ | {"PYTHONPATH": str(tree)}
    subprocess.run(words, cwd=tree, env=paths, capture_output=True, check=False)
    try:
        return read_run(out)
    except SceneError:
        return None


def rows(tree: Path, names: Sequence[str], changes: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Of each case by this tree and by the other."""
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            here, there = (
                made(one, name, Path(folder) / str(number), changes)
                for number, one in enumerate((ROOT, tree))
            )
        if here is None or there is None:
            yield name, "no run", *("",) * (len(HEAD) - 2)
            continue
        end = min(here.history["time_s"][-1], there.history["time_s"][-1])
        times = np.linspace(0.0, end, MOMENTS)
        curves: list[Array] = [
            np.interp(times, run.history["time_s"], run.history["mu"]) for run in (here, there)
        ]
        one, other = curves
        largest = float(np.abs(one - other).max() / other.mean())
        yield (
            name, here.summary["steps"], there.summary["steps"],
            f"{here.summary['wall_s']:.1f}", f"{there.summary['wall_s']:.1f}",
            f"{largest:.1e}", f"{one.mean() / other.mean() - 1.0:+.1e}",
        )  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment of one case, with itself")
    parser.add_argument("--against", type=Path, default=ROOT, help="the other tree")
    parser.add_argument("--cases", nargs="+", choices=sliding_cases(), default=sliding_cases())
    parser.add_argument("--blocks", action="store_true", help="blocks instead of slices")
    asked = parser.parse_args()
    model = "model=block" if asked.blocks else "model=slice"
    names, moment = asked.cases, ()
    if asked.quick:
        names, moment = ["thesis_1bar"], ("load.duration=0.1ms", "numerics.refinement=0.5")
    table(HEAD, rows(asked.against.resolve(), names, (model, TOLERANCE, *moment)))


if __name__ == "__main__":
    main()
