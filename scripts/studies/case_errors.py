"""What each case's mu(t) is off by: mesh and steps together, against a finer run of the same.

Every case is run as a slice or as a block, at a tolerance and on its own mesh, and compared with a
run on a mesh twice as fine (or --finer) with a sixth of the tolerance, over all of its time; with
--meshes also on others, so many times as fine as its own, against the same.
Differences are in fractions of the mean of mu, because mu itself begins at nothing where a
plate does.
Prints them beside seconds and draws both curves of each case. Runs are kept in a folder and taken
from there the next time; --quick is one short, coarse pair.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.runtime.arrays import Array
from scripts.studies import common

CASES = (
    "thesis_1bar", "thesis_5bar", "paper_1bar", "paper_5bar", "thesis_sliding_1bar",
    "thesis_sliding_5bar", "tread_block", "siped_tread", "load_step", "friction_tester",
    "braking_wheel",
)  # fmt: skip
STRICTER = 6.0  # the reference's tolerance
TIMES = 2000
MS = 1e3
HEAD = ("case", "mesh", "tolerance", "unknowns", "steps", "s", "largest", "at, ms", "rms",
        "of mean mu", "reference: unknowns", "its steps", "its s")  # fmt: skip


class Pair(NamedTuple):
    """A case's run and its reference, and mu(t) of both at the same times (s)."""

    name: str
    mesh: float
    tolerance: float
    run: Run
    fine: Run
    times: Array
    mu: Array
    exact: Array

    @property
    def row(self) -> Sequence[object]:
        """Of the table."""
        mean = float(np.mean(self.exact))
        off = (self.mu - self.exact) / mean
        worst = int(np.abs(off).argmax())
        run, fine = self.run.summary, self.fine.summary
        return (
            self.name, f"{self.mesh:g}", f"{self.tolerance:g}",
            run["dofs"], run["steps"], f"{run['wall_s']:.1f}",
            f"{abs(off[worst]):.2%}", f"{MS * self.times[worst]:.2f}",
            f"{np.sqrt(np.mean(off**2)):.2%}", f"{run['mu_mean'] / fine['mu_mean'] - 1:+.2%}",
            fine["dofs"], fine["steps"], f"{fine['wall_s']:.0f}",
        )  # fmt: skip


def kept(folder: Path, name: str, *changes: str) -> Run:
    """The run of a case in `folder`, made if it is not there. Raises CalledProcessError."""
    if not (folder / "summary.json").is_file():
        scene = common.ROOT / "cases" / f"{name}.toml"
        common.silently(common.run_words(scene, folder, *changes))
    return read_run(folder)


def compared(
    runs: Path, name: str, tolerance: float, changes: Sequence[str], mesh: float, finer: float
) -> Pair:
    """The case with the `changes`, on a `mesh` so many times as fine as its own, and on one that is
    `finer`.
    """
    finest = tolerance / STRICTER
    own = common.case(name, *changes).numerics.refinement
    run, fine = (
        kept(
            runs / f"{name}_{refinement:g}_{strict:.3g}", name, *changes,
            f"numerics.refinement={refinement}", f"numerics.tolerance={strict}",
        )
        for refinement, strict in ((mesh * own, tolerance), (finer * own, finest))
    )  # fmt: skip
    end = min(float(one.history["time_s"][-1]) for one in (run, fine))
    times = np.linspace(0.0, end, TIMES)
    mu, exact = (np.interp(times, one.history["time_s"], one.history["mu"]) for one in (run, fine))
    return Pair(name, mesh, tolerance, run, fine, times, mu, exact)


def draw(pairs: Sequence[Pair], path: Path) -> None:
    """mu(t) of every case beside that of its reference."""
    rows = -(-len(pairs) // 3)
    figure = Figure(figsize=(11.0, 2.5 * rows), layout="constrained")
    panels = figure.subplots(rows, min(3, len(pairs)), squeeze=False).ravel()
    for panel in panels[len(pairs) :]:
        panel.set_axis_off()
    for panel, pair in zip(panels, pairs, strict=False):
        panel.plot(MS * pair.times, pair.exact, color="C1", linewidth=2.5, alpha=0.6)
        panel.plot(MS * pair.times, pair.mu, color="C0", linewidth=0.9)
        panel.set_title(f"{pair.name}, mesh {pair.mesh:g}, {pair.tolerance:g}", fontsize="medium")
        panel.set_ylim(bottom=0.0)
        panel.grid(alpha=0.3)
    for panel in panels[::3]:
        panel.set_ylabel("mu")
    for panel in panels[max(len(pairs) - 3, 0) : len(pairs)]:
        panel.set_xlabel("time, ms")
    panels[0].legend(["reference", "run"], fontsize="small")
    common.draw(figure, path)


def main() -> None:
    """Print the table and draw the curves."""
    parser = common.options(__doc__)
    parser.add_argument("--cases", nargs="+", default=list(CASES), help="those of the folder cases")
    parser.add_argument("--model", choices=("slice", "block"), default="slice")
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-2])
    parser.add_argument("--meshes", nargs="+", type=float, default=[1.0], help="times as fine")
    parser.add_argument("--finer", type=float, default=2.0, help="the reference's mesh")
    parser.add_argument("--runs", type=Path, default=common.RESULTS / "case_errors")
    parser.add_argument("--quick", action="store_true", help="one short, coarse pair")
    common.picture_options(parser)
    options = parser.parse_args()
    changes, meshes, finer = [f"model={options.model}"], options.meshes, options.finer
    cases, runs = options.cases, options.runs / options.model
    if options.quick:
        changes, meshes, finer = [*changes, "load.duration=0.1ms"], [0.5], 1.0
        cases, runs = cases[:1], runs / "quick"
    pairs: list[Pair] = []

    def rows() -> Iterator[Sequence[object]]:
        for name, mesh, tolerance in product(cases, meshes, options.tolerances):
            pairs.append(compared(runs, name, tolerance, changes, mesh, finer))
            yield pairs[-1].row

    common.table(HEAD, rows())
    draw(pairs, options.pictures / f"case_errors_{options.model}.png")


if __name__ == "__main__":
    main()
