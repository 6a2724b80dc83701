"""Which direction's cells the error of mu comes from in 3-D: along x (sliding), y or z.

Slides a case as a block with cells made shorter or longer along one direction at a time and prints
unknowns, steps, processor seconds, the error of mu(t) against a run with cells half as long in all
directions and a sixth of the tolerance, and that of the plate's displacement at the end. The
reference is kept in a folder and computed once, on two ranks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np

from iceslide_fem.mesh import box
from iceslide_fem.mesh.rubber import divisions
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.results import Run, read_run
from iceslide_fem.scene import Scene
from scripts.studies.common import ROOT, case, options, run_words, silently, table

# How many times shorter cells are along x, y, z than by default, where those of a cube are shorter
# along x: the second row is a cube with cells alike.
ALIKE = (1.0 / box.SHORTER_ALONG_X[3], 1.0, 1.0)
FACTORS = (
    (1.0, 1.0, 1.0),
    ALIKE,
    (1.5, 1.0, 1.0),
    (1.0, 1.5, 1.0),
    (1.0, 1.0, 1.5),
    (1.0, 1.0, 0.75),
)
LOOSE = 1e-2  # tolerance of the runs
TIMES = 500


def reference(name: str, changes: list[str], refinement: float, folder: Path) -> Run:
    """The fine run in `folder`, made if it is not there."""
    if not (folder / "summary.json").is_file():
        duration = case(name, *changes).load.duration
        fine = [f"numerics.tolerance={LOOSE / 6.0}", f"numerics.max_step={duration / 240.0}",
                f"numerics.refinement={2.0 * refinement}"]  # fmt: skip
        silently(run_words(ROOT / "cases" / f"{name}.toml", folder, *changes, *fine, ranks=2))
    return read_run(folder)


def row(scene: Scene, factors: tuple[float, ...], fine: Run) -> Iterator[object]:
    """Cells of a run with cells shorter by `factors`, what it took, and its errors."""
    from iceslide_fem.fenics.start import start_petsc
    from scripts.studies.blocks import slid  # starts MPI, after which nothing runs under mpirun

    start_petsc()
    usual = box.reference_cells

    def shorter(block: BlockShape, refinement: float) -> tuple[list[float], float]:
        cells, size = usual(block, refinement)
        return [cell / by for cell, by in zip(cells, factors, strict=True)], size

    with patch.object(box, "reference_cells", shorter):
        size = divisions(scene)
        found = slid(scene)
    times = np.linspace(0.0, scene.load.duration, TIMES)
    known = fine.history
    error = np.interp(times, found.time, found.mu) / np.interp(times, known["time_s"], known["mu"])
    error = np.abs(error - 1.0)
    plate = found.last.current.mechanics.plate_displacement
    yield " x ".join(f"{size[name]:.0f}" for name in ("nx", "ny", "nz"))
    yield f"{3 * size['quadratic_nodes']:.0f}"
    yield found.steps
    yield f"{found.seconds:.1f}"
    for value in (error.max(), math.sqrt(np.mean(error**2)), error.mean()):
        yield f"{value:.2%}"
    yield f"{found.mean / fine.summary['mu_mean'] - 1.0:+.2%}"
    yield f"{plate / known['plate_displacement_m'][-1] - 1.0:+.2%}"


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--case", default="thesis_1bar", help="of the folder cases")
    parser.add_argument("--references", type=Path, default=ROOT / "results" / "references")
    parser.add_argument("--quick", action="store_true", help="two coarse, short runs")
    arguments = parser.parse_args()
    name, refinement = arguments.case, 0.25 if arguments.quick else 1.0
    changes = (
        ["model=block", "ice.heat=continuum"] if name.startswith("thesis") else ["model=block"]
    )
    changes += ["load.duration=0.2ms"] if arguments.quick else []
    fine = reference(name, changes, refinement, arguments.references / f"{name}_block")
    print(f"reference: {fine.summary['steps']} steps, {fine.summary['dofs']} unknowns, refinement "
          f"{fine.summary['scene']['numerics']['refinement']:g}")  # fmt: skip
    scene = case(name, *changes, f"numerics.tolerance={LOOSE}", f"numerics.refinement={refinement}")
    head = ("cells", "unknowns", "steps", "processor s", "largest", "rms", "mean", "of mean mu",
            "plate")  # fmt: skip
    factors = FACTORS[:2] if arguments.quick else FACTORS
    table(head, (tuple(row(scene, each, fine)) for each in factors))


if __name__ == "__main__":
    main()
