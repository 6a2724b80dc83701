"""Which direction's cells the error of mu comes from in 3-D: along x (sliding), y or z.

Slides thesis_1bar as a block with cells made shorter or longer along one direction at a time and
prints unknowns, steps, processor seconds, the error of mu(t) against a run with cells half as long
in all directions and a sixth of the tolerance, and that of the plate's displacement at the end. The
reference is that of the study `speed`, kept in a folder and computed once.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np

from iceslide_fem.mesh import box
from iceslide_fem.mesh.rubber import divisions
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.results import Run
from iceslide_fem.scene import Scene
from scripts.studies.common import ROOT, case, options, table
from scripts.studies.speed import reference

# How many times shorter cells are along x, y, z than by default, where those of a cube are shorter
# along x: the second row is a cube with cells alike.
ALIKE = (1.0 / box.SHORTER_ALONG_X[3], 1.0, 1.0)
FACTORS: tuple[tuple[float, float, float], ...] = (
    (1.0, 1.0, 1.0),
    ALIKE,
    (1.5, 1.0, 1.0),
    (1.0, 1.5, 1.0),
    (1.0, 1.0, 1.5),
    (1.0, 1.0, 0.75),
)
CASE = "thesis_1bar"
LOOSE, STEPS = 1e-2, 60  # tolerance of the runs, and how many steps they take
TIMES = 500


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
    parser.add_argument("--references", type=Path, default=ROOT / "results" / "references")
    parser.add_argument("--quick", action="store_true", help="two coarse, short runs")
    arguments = parser.parse_args()
    refinement, changes = 1.0, ["model=block", "ice.heat=continuum"]
    factors, folder, steps = FACTORS, arguments.references, STEPS
    with tempfile.TemporaryDirectory() as name:
        if arguments.quick:  # of which no reference is to be kept
            refinement, factors, folder = 0.25, FACTORS[:2], Path(name)
            changes.append("load.duration=0.2ms")
            steps *= 35  # in the 7 ms that a reference's steps are told by
        fine = reference(folder / f"{CASE}_block", LOOSE, steps, changes, refinement)
    coarse = [f"numerics.tolerance={LOOSE}", f"numerics.refinement={refinement}"]
    scene = case(CASE, *changes, *coarse)
    head = ("cells", "unknowns", "steps", "processor s", "largest", "rms", "mean", "of mean mu",
            "plate")  # fmt: skip
    table(head, (tuple(row(scene, each, fine)) for each in factors))


if __name__ == "__main__":
    main()
