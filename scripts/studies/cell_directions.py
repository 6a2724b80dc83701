"""Which direction's cells the error of mu comes from in 3-D: along x (sliding), y or z.

Slides thesis_1bar as a block with cells made shorter or longer along one direction at a time and
prints unknowns, steps, processor seconds, the error of mu(t) against a run with cells half as long
in all directions and a sixth of the tolerance, and that of the plate's displacement at the end. The
reference is that of the study `speed`, kept in a folder and computed once. With `--points` the
cells stay and the contact's points on each facet change, along x and across.
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
# Degrees of the Gauss rules on each half of a facet, along x and across: by default, as many points
# across as along, fewer.
RULES: tuple[tuple[int, int], ...] = ((7, 3), (7, 7), (5, 3), (3, 3), (7, 1))
CASE = "thesis_1bar"
LOOSE, STEPS = 1e-2, 60  # tolerance of the runs, and how many steps they take
TIMES = 500


def of_cells(scene: Scene, factors: tuple[float, ...], fine: Run) -> Iterator[object]:
    """Cells of a run with cells shorter by `factors`, what it took, and its errors."""
    usual = box.reference_cells

    def shorter(block: BlockShape, refinement: float) -> tuple[list[float], float]:
        cells, size = usual(block, refinement)
        return [cell / by for cell, by in zip(cells, factors, strict=True)], size

    with patch.object(box, "reference_cells", shorter):
        size = divisions(scene)
        yield " x ".join(f"{size[name]:.0f}" for name in ("nx", "ny", "nz"))
        yield f"{3 * size['quadratic_nodes']:.0f}"
        yield from taken(scene, fine)


def of_points(scene: Scene, rule: tuple[int, int], fine: Run) -> Iterator[object]:
    """Points on a facet by a `rule`, degrees along x and across; what it took, and its errors."""
    from iceslide_fem.rubber import contact_points  # starts MPI, too

    along, across = rule
    with patch.multiple(contact_points, FACET_DEGREE=along, ACROSS_DEGREE=across):
        yield " x ".join(f"{contact_points.FACET_PIECES * ((degree + 1) // 2)}" for degree in rule)
        yield from taken(scene, fine)


def taken(scene: Scene, fine: Run) -> Iterator[object]:
    """Steps and processor seconds of a run, and its errors against a `fine` one."""
    from iceslide_fem.fenics.start import start_petsc
    from scripts.studies.blocks import slid  # starts MPI, after which nothing runs under mpirun

    start_petsc()
    found = slid(scene)
    times = np.linspace(0.0, scene.load.duration, TIMES)
    known = fine.history
    error = np.interp(times, found.time, found.mu) / np.interp(times, known["time_s"], known["mu"])
    error = np.abs(error - 1.0)
    plate = found.last.current.mechanics.plate_displacement
    yield found.steps
    yield f"{found.seconds:.1f}"
    for value in (error.max(), math.sqrt(np.mean(error**2)), error.mean()):
        yield f"{value:.2%}"
    yield f"{found.mean / fine.summary['mu_mean'] - 1.0:+.2%}"
    yield f"{plate / known['plate_displacement_m'][-1] - 1.0:+.2%}"


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--references", type=Path, default=ROOT / "results" / "references")
    parser.add_argument("--points", action="store_true", help="of the contact instead of cells")
    parser.add_argument("--quick", action="store_true", help="two coarse, short runs")
    arguments = parser.parse_args()
    refinement, changes = 1.0, ["model=block", "ice.heat=continuum"]
    cells, rules, folder, steps = FACTORS, RULES, arguments.references, STEPS
    with tempfile.TemporaryDirectory() as name:
        if arguments.quick:  # of which no reference is to be kept
            refinement, cells, rules, folder = 0.25, FACTORS[:2], RULES[:2], Path(name)
            changes.append("load.duration=0.2ms")
            steps *= 35  # in the 7 ms that a reference's steps are told by
        fine = reference(folder / f"{CASE}_block", LOOSE, steps, changes, refinement)
    coarse = [f"numerics.tolerance={LOOSE}", f"numerics.refinement={refinement}"]
    scene = case(CASE, *changes, *coarse)
    errors = ("steps", "processor s", "largest", "rms", "mean", "of mean mu", "plate")
    if arguments.points:
        table(("points", *errors), (tuple(of_points(scene, rule, fine)) for rule in rules))
    else:
        head = ("cells", "unknowns", *errors)
        table(head, (tuple(of_cells(scene, each, fine)) for each in cells))


if __name__ == "__main__":
    main()
