"""mu(t) of the cases by this package and by that of another tree: what a change of it moves.

Every case runs as a slice, with `--blocks` as a block instead, at a tolerance of 1e-2. Differences
are relative to the mean of mu: of mu(t), the largest, and of its mean. `--quick` compares a moment
of one case with itself.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from scripts.studies.command_runs import MOMENT, found, moved
from scripts.studies.common import ROOT, case, fault, options, table

HEAD = ("case", "steps", "there", "s", "there", "largest of mu(t)", "of mean mu")
TOLERANCE = "numerics.tolerance=1e-2"


def sliding_cases() -> list[str]:
    """Names of the cases that are more than a point."""
    files = sorted((ROOT / "cases").glob("*.toml"))
    return [file.stem for file in files if case(file.stem).model != "point"]


def rows(tree: Path, names: Sequence[str], changes: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Of each case by this tree and by the other."""
    for name in names:
        try:
            here, there = (found(name, changes, 1, tree=one) for one in (ROOT, tree))
        except subprocess.CalledProcessError as error:
            yield name, fault(error.stderr.decode()), *("",) * (len(HEAD) - 2)
            continue
        runs = here.summary, there.summary
        steps, seconds = ([run[key] for run in runs] for key in ("steps", "wall_s"))
        yield name, *steps, *(f"{one:.1f}" for one in seconds), *moved(here, there)


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment of one case, with itself")
    parser.add_argument("--against", type=Path, default=ROOT, help="the other tree")
    parser.add_argument("--cases", nargs="+", choices=sliding_cases(), default=sliding_cases())
    parser.add_argument("--blocks", action="store_true", help="blocks instead of slices")
    asked = parser.parse_args()
    model = "model=block" if asked.blocks else "model=slice"
    names, moment = (["thesis_1bar"], MOMENT) if asked.quick else (asked.cases, ())
    table(HEAD, rows(asked.against.resolve(), names, (model, TOLERANCE, *moment)))


if __name__ == "__main__":
    main()
