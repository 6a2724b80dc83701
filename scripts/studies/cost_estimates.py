"""What `iceslide info` expects of a run against what the run takes: steps, seconds, memory.

Every scene is run in a process of its own, forms compiled before. Seconds are those of the
processor, so other work on the machine hardly counts. Large meshes run for a part of the time
only. At the end come the constants of `iceslide_fem/workflow/planning/cost.py` that fit these
seconds best, to enter there.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from subprocess import DEVNULL, Popen
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning import cost
from iceslide_fem.workflow.planning.cost import Cost, estimate
from scripts.studies.common import ROOT, case, options, run_words, table

# case, changes: short and long, coarse and fine, attached and sliding, slice and block
SCENES = [
    ("thesis_1bar", "model=point ice.heat=column"),
    ("thesis_1bar", "model=slice"),
    ("thesis_1bar", "model=slice ice.heat=column"),
    ("thesis_5bar", "model=slice ice.heat=half-space numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice numerics.refinement=3 numerics.tolerance=1e-2 load.duration=2ms"),
    ("thesis_1bar", "model=slice numerics.refinement=8 numerics.tolerance=1e-2 load.duration=20us"),
    ("thesis_1bar", "model=slice rubber.heat=true ice.heat=column numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice rubber.height=0.5mm ice.heat=column numerics.tolerance=1e-2"),
    ("thesis_sliding_1bar", "model=slice"),
    ("tread_block", "model=slice load.duration=2ms"),
    ("user_mesh", "numerics.tolerance=1e-2"),
    ("thesis_1bar", "numerics.refinement=0.5 ice.heat=column numerics.tolerance=1e-2"),
    ("thesis_1bar", "numerics.tolerance=1e-2 ice.heat=column"),
    ("thesis_1bar", "numerics.refinement=2 ice.heat=column load.duration=20us"),
    ("thesis_sliding_1bar", "model=block numerics.refinement=0.5 numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice numerics.tolerance=1e-2"),
    ("thesis_1bar", "numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice ice.heat=mesh"),
    ("thesis_1bar", "model=slice ice.heat=mesh numerics.tolerance=1e-2"),
    ("thesis_1bar", "ice.heat=mesh numerics.tolerance=1e-2"),
    ("thesis_sliding_5bar", "model=slice ice.heat=mesh numerics.tolerance=1e-2"),
]  # fmt: skip
QUICK = [0, 3, 10]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="three of the scenes")
    chosen = [SCENES[n] for n in QUICK] if parser.parse_args(arguments).quick else SCENES
    factors: list[tuple[float, float, float]] = []
    runs: list[Run] = []
    head = (
        "scene", "changes", "unknowns, rubber", "ice", "steps", "expected", "s", "expected",
        "MB", "expected",
    )  # fmt: skip

    def rows() -> Iterator[tuple[object, ...]]:
        for name, changes in chosen:
            scene = case(name, *changes.split())
            expected = estimate(scene)
            steps, seconds, memory = measured(name, changes.split())
            factors.append(
                (expected.steps / steps, expected.time / seconds, expected.memory / memory)
            )
            runs.append(Run(scene, expected, steps, seconds))
            yield (
                name, changes, expected.rubber_unknowns, expected.ice_unknowns, steps,
                expected.steps, f"{seconds:.1f}", f"{expected.time:.1f}", f"{memory / 1e6:.0f}",
                f"{expected.memory / 1e6:.0f}",
            )  # fmt: skip

    table(head, rows())
    print("\nexpected over measured, smallest, median, largest:")
    for what, values in zip(("steps", "seconds", "memory"), np.array(factors).T, strict=True):
        print(f"{what}: {_spread(values)}")
    fit(runs)


class Run(NamedTuple):
    """A scene, what was expected, and the steps and seconds that it took."""

    scene: Scene
    expected: Cost
    steps: int
    seconds: float


def fit(runs: Sequence[Run]) -> None:
    """Print the constants that fit the seconds of these runs best, in relative terms."""
    seconds = np.array([run.seconds for run in runs])
    parts = np.array([seconds_by_constant(run) for run in runs])
    found, _ = nnls(parts / seconds[:, None], np.ones(len(runs)))
    start, *pairs = found
    print("\nconstants that fit best (0: not in these runs, or lost in another one):")
    print(f"START_SECONDS = {start:.2g}")
    names = "PLANE", "SPACE", "ICE", "MESHED"
    for name, pair in zip(names, np.reshape(pairs, (4, 2)), strict=True):
        print(f"{name}_SECONDS = {pair[0]:.2g}, {pair[1]:.2g}")
    print(
        f"seconds by them, at the steps measured, over measured: {_spread(parts @ found / seconds)}"
    )


def seconds_by_constant(run: Run) -> Array:
    """What a run takes for each constant of `cost`: start; plane, space, continuum ice and ice
    on a mesh, two of each.
    """
    parts = np.zeros(9)
    parts[0] = 1.0
    if run.scene.model == "point":
        return parts
    steps, (_, rubber, ice) = run.steps + cost.START_STEPS, run.expected[:3]
    plane = run.scene.model == "slice"
    first = 1 if plane else 3
    parts[first : first + 2] = steps, steps * rubber ** cost.work_power(2 if plane else 3)
    if ice:
        of_ice = 7 if run.scene.ice.heat == "mesh" else 5
        parts[of_ice : of_ice + 2] = steps, steps * ice
    return parts


def _spread(values: Array) -> str:
    return f"{values.min():.2f}, {np.median(values):.2f}, {values.max():.2f}"


def measured(name: str, changes: list[str]) -> tuple[int, float, float]:
    """Steps, processor seconds and memory (bytes) of a run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        words = run_words(ROOT / "cases" / f"{name}.toml", out, *changes)
        with Popen(words, stdout=DEVNULL, stderr=DEVNULL, cwd=ROOT) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            sys.exit(f"{name} {' '.join(changes)} ended with exit code {process.returncode}")
        steps = json.loads((out / "summary.json").read_text())["steps"]
    return steps, used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss


if __name__ == "__main__":
    main()
