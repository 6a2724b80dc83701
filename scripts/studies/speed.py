"""Seconds and error of a case in 3-D and 2-D: thesis_1bar with continuum ice, or another as it is.

The error is that of mu(t) over all of its time against a run with a mesh twice as fine and steps at
least four times as fine; references are kept in a folder and computed once. Each timed run is a
process of its own, started after its forms were compiled. With `--repeats` all are made as many
times, in turn, and times are medians. A reference once made serves for any `--refinement`: its own
is printed. With `--against TREE` the same runs are made by the package in
that folder, too, one after the other, and the ratios of their times are printed, that of the
quickest, which other work on the machine has disturbed least, among them. The ice's fraction of
the steps is that of its stages without the film's, by a clock around each.
"""

from __future__ import annotations

import os
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from iceslide_fem.postprocess.results import Run, differences, read_run
from iceslide_fem.scene import Scene
from scripts.studies.common import ROOT, case, options, processor_seconds, run_words, table

CHANGES = {"thesis_1bar": ["ice.heat=continuum"], "tread_block": []}
# s on one rank at a tolerance of 1e-2
LIMITS = {
    ("thesis_1bar", "slice"): 1.5,
    ("thesis_1bar", "block"): 14.0,
    ("tread_block", "slice"): 1.5,
}
HEAD = ("tree", "tolerance", "ranks", "unknowns", "steps", "seconds", "processor s",
        "largest", "rms", "mean", "of mean mu")  # fmt: skip


class Timed(NamedTuple):
    """A run, its seconds, and the processor seconds of all its processes."""

    run: Run
    seconds: float
    processor: float


def median(runs: list[Timed]) -> Timed:
    """The last of equal runs with the medians of their seconds."""
    seconds, processor = (
        float(np.median([getattr(timed, name) for timed in runs])) for name in Timed._fields[1:]
    )
    return Timed(runs[-1].run, seconds, processor)


def make(tree: Path, name: str, out: Path, ranks: int, changes: list[str]) -> Timed:
    """Run the case `name` with the package of `tree`."""
    file = ROOT / "cases" / f"{name}.toml"
    words = [word for word in run_words(file, out, *changes, ranks=ranks) if word != "--force"]
    paths = os.environ | {"PYTHONPATH": str(tree)}
    spent = processor_seconds(words, check=True, cwd=tree, env=paths)
    run = read_run(out)
    return Timed(run, run.summary["wall_s"], spent)


def ice_share(scene: Scene) -> float:
    """The ice's fraction of the steps on one rank: its stages less what the film takes of them."""
    from iceslide_fem.coupling.sliding import Sliding
    from iceslide_fem.fenics.start import start_petsc
    from iceslide_fem.film.ice_heat import Column
    from iceslide_fem.film.loads import FilmOnIce
    from iceslide_fem.interface.ice_continuum import Continuum
    from scripts.studies.blocks import slid  # starts MPI, after which nothing runs under mpirun

    start_petsc()
    spent: dict[str, float] = defaultdict(float)

    @contextmanager
    def clocked(owner: type, name: str) -> Iterator[None]:
        method = getattr(owner, name)

        def timed(*arguments: object) -> object:
            start = perf_counter()
            try:
                return method(*arguments)
            finally:
                spent[name] += perf_counter() - start

        with patch.object(owner, name, timed):
            yield

    ice = Continuum if scene.ice.heat == "continuum" else Column
    with clocked(Sliding, "advance"), clocked(ice, "stage"), clocked(FilmOnIce, "solve"):
        slid(scene)
    return (spent["stage"] - spent["solve"]) / spent["advance"]


def reference(
    folder: Path, name: str, loose: float, steps: int, changes: list[str], refinement: float
) -> Run:
    """The fine run of the case `name` in `folder`, made if it is not there.

    Steps are as tolerance^0.8 (docs/validation/accuracy.md): four times as many at a sixth.
    """
    if not (folder / "summary.json").is_file():
        fine = [
            f"numerics.max_step={case(name).load.duration / (4 * steps)}",
            f"numerics.tolerance={loose / 6.0}",
            f"numerics.refinement={2.0 * refinement}",
        ]
        make(ROOT, name, folder, 2, [*changes, *fine])
    run = read_run(folder)
    summary = run.summary
    print(
        f"reference: {summary['steps']} steps, {summary['dofs']} unknowns, "
        f"{summary['wall_s']:.0f} s, refinement {summary['scene']['numerics']['refinement']:g}"
    )
    return run


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--case", choices=CHANGES, default="thesis_1bar")
    parser.add_argument("--model", choices=("slice", "block"), default="slice")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--tolerances", nargs="+", default=["1e-2", "1e-3"])
    parser.add_argument("--refinement", type=float, default=1.0, help="of the timed runs' mesh")
    parser.add_argument("--references", type=Path, default=ROOT / "results" / "references")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--against", type=Path, help="folder with another version of the package")
    arguments = parser.parse_args()
    name, model = arguments.case, arguments.model
    scene = [f"model={model}", *CHANGES[name]]
    trees = [ROOT] + ([arguments.against.resolve()] if arguments.against else [])
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        runs: dict[tuple[str, int, Path], list[Timed]] = defaultdict(list)
        for repeat in range(arguments.repeats):
            for tolerance, ranks, tree in product(arguments.tolerances, arguments.ranks, trees):
                numerics = [
                    f"numerics.tolerance={tolerance}",
                    f"numerics.refinement={arguments.refinement}",
                ]
                out = folder / f"{tolerance}_{ranks}_{trees.index(tree)}"
                if not repeat:
                    warm = out.with_suffix(".warm")
                    make(tree, name, warm, ranks, [*scene, *numerics, "load.duration=20us"])
                timed = make(tree, name, out, ranks, [*scene, *numerics])
                runs[tolerance, ranks, tree].append(timed)
        found = {which: median(timed) for which, timed in runs.items()}
        loose = max(float(tolerance) for tolerance in arguments.tolerances)
        steps = min(timed.run.summary["steps"] for timed in found.values())
        kept = arguments.references / f"{name}_{model}"
        fine = reference(kept, name, loose, steps, scene, arguments.refinement)
        rows = []
        for (tolerance, ranks, tree), (run, seconds, processor) in found.items():
            error = np.abs(differences(run, fine))
            summary = run.summary
            sizes = (error.max(), np.sqrt(np.mean(error**2)), error.mean())
            rows.append((
                "this" if tree == ROOT else tree.name, tolerance, ranks, summary["dofs"],
                summary["steps"], f"{seconds:.1f}", f"{processor:.1f}",
                *(f"{size:.2%}" for size in sizes),
                f"{summary['mu_mean'] / fine.summary['mu_mean'] - 1:.2%}",
            ))  # fmt: skip
        table(HEAD, rows)
        for (tolerance, ranks, tree), timed in found.items():
            if tree != ROOT:
                new = found[tolerance, ranks, ROOT]
                wall = timed.seconds / new.seconds
                old, least = (
                    min(one.seconds for one in runs[tolerance, ranks, of]) for of in (tree, ROOT)
                )
                print(f"{tolerance}, {ranks} ranks: {wall:.2f} times as fast as {tree.name}, "
                      f"{timed.processor / new.processor:.2f} by the processor, {old / least:.2f} "
                      f"by the quickest runs ({old:.2f} and {least:.2f} s)")  # fmt: skip
        for tolerance in arguments.tolerances:
            walls = [found[tolerance, n, ROOT].seconds for n in arguments.ranks]
            if len(walls) > 1:
                print(f"{tolerance}: {arguments.ranks[-1]} ranks {walls[0] / walls[-1]:.2f} times "
                      f"as fast as {arguments.ranks[0]}")  # fmt: skip
        first = case(name, *scene, f"numerics.tolerance={arguments.tolerances[0]}")
        share = ice_share(first)
        print(f"fraction of the ice in the steps at {arguments.tolerances[0]}: {share:.1%}")
        if (name, model) in LIMITS:
            print(f"limit: {LIMITS[name, model]:g} s on one rank at 1e-2")


if __name__ == "__main__":
    main()
