"""How much faster blocks are on several ranks: seconds of whole runs, and what that changes.

The runs of all numbers of ranks are made in turn, `--repeats` times: seconds are medians, with the
least and the most of them beside. mu(t) is compared with that on the first number of ranks, by
its mean. --solver gives options of PETSc's, as
`--solver="-rubber_pc_type lu"`. --quick runs half of the refinement for a moment, once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from scripts.studies.command_runs import CASES, MOMENT, Found, found, moved
from scripts.studies.common import options, table

TOLERANCE = "1e-2"
HEAD = ("case", "ranks", "unknowns", "steps", "iterations", "MB a rank", "wall s", "least", "most",
        "times as fast", "largest of mu(t)", "of mean mu")  # fmt: skip


def rows(
    cases: Sequence[str],
    ranks: Sequence[int],
    repeats: int,
    moment: Sequence[str],
    solver: Sequence[str],
) -> Iterator[tuple[object, ...]]:
    """Of each case on every number of ranks."""
    for case in cases:
        changes = ("model=block", *CASES[case], f"numerics.tolerance={TOLERANCE}", *moment)
        runs: dict[int, list[Found]] = {number: [] for number in ranks}
        for _ in range(repeats):
            for number, made in runs.items():
                made.append(found(case, changes, number, *solver))
        seconds = {
            number: np.array([run.summary["wall_s"] for run in made])
            for number, made in runs.items()
        }
        first = runs[ranks[0]][0]
        for number, made in runs.items():
            summary, spent = made[0].summary, seconds[number]
            yield (
                case, number, summary["dofs"], summary["steps"], summary["newton_iterations"],
                f"{made[0].memory / 1e6:.0f}", f"{np.median(spent):.3g}",
                f"{spent.min():.3g}", f"{spent.max():.3g}",
                f"{np.median(seconds[ranks[0]]) / np.median(spent):.2f}",
                *moved(made[0], first),
            )  # fmt: skip


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment on coarse meshes, once")
    parser.add_argument("--cases", nargs="+", choices=tuple(CASES), default=tuple(CASES))
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--duration", help="of the slides, with its unit, for counts alone")
    parser.add_argument("--solver", default="", help="options of PETSc's")
    arguments = parser.parse_args()
    repeats, moment = (1, MOMENT) if arguments.quick else (arguments.repeats, ())
    if arguments.duration:
        moment = *moment, f"load.duration={arguments.duration}"
    solver = arguments.solver.split()
    table(HEAD, rows(arguments.cases, arguments.ranks, repeats, moment, solver))


if __name__ == "__main__":
    main()
