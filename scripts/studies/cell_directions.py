"""Which direction's cells the error of mu comes from in 3-D: along x (sliding), y or z.

Slides thesis_1bar as a block with cells made shorter or longer along one direction at a time and
prints unknowns, steps, processor seconds, the error of mu(t) against a run with cells half as long
in all directions and a sixth of the tolerance, and that of the plate's displacement at the end. The
reference is that of the study `speed`, kept in a folder and computed once. With `--points` the
cells stay and the contact's points on each facet change, along x and across; then also in
thesis_5bar, where the sides roll onto the ice, against the same mesh with 14 points across.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from unittest.mock import patch

import numpy as np

from iceslide_fem.mesh import box
from iceslide_fem.mesh.rubber import divisions
from iceslide_fem.mesh.shape import BlockShape
from iceslide_fem.postprocess.results import Run
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from scripts.studies.common import ROOT, case, options, table
from scripts.studies.speed import reference

if TYPE_CHECKING:
    from scripts.studies.blocks import Slide

# How many times shorter cells are along x, y, z than by default, where those of a cube are shorter
# along x and longer along z: the second row is a cube with cells alike.
ALIKE = (1.0 / box.SHORTER_ALONG_X[3], 1.0, box.LONGER_ALONG_Z[3])
FACTORS: tuple[tuple[float, float, float], ...] = (
    (1.0, 1.0, 1.0),
    ALIKE,
    (1.5, 1.0, 1.0),
    (1.0, 1.5, 1.0),
    (1.0, 1.0, 1.5),
    (1.0, 1.0, 0.75),
)
# Degrees of the Gauss rules on each half of a facet, along x and across: by default, as many points
# across as along, fewer; and the most.
RULES: tuple[tuple[int, int], ...] = ((7, 5), (7, 7), (7, 3), (5, 5), (5, 3), (7, 1))
MOST = (7, 13)
CASE, BULGING = "thesis_1bar", "thesis_5bar"
LOOSE, STEPS = 1e-2, 60  # tolerance of the runs, and how many steps they take
TIMES = 500


class Known(NamedTuple):
    """mu(t) of a finer run, s and 1, its mean and the plate's displacement at the end, m."""

    time: Array
    mu: Array
    mean: float
    plate: float

    @classmethod
    def of(cls, run: Run) -> Known:
        """From the outputs of a run."""
        history = run.history
        plate = float(history["plate_displacement_m"][-1])
        return cls(history["time_s"], history["mu"], run.summary["mu_mean"], plate)


def of_cells(scene: Scene, factors: tuple[float, ...], fine: Known) -> Iterator[object]:
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


def of_points(scene: Scene, rule: tuple[int, int], fine: Known) -> Iterator[object]:
    """Points on a facet by a `rule`, degrees along x and across; what it took, and its errors."""
    with points(rule) as pieces:
        yield " x ".join(f"{pieces * ((degree + 1) // 2)}" for degree in rule)
        yield from taken(scene, fine)


@contextmanager
def points(rule: tuple[int, int]) -> Iterator[int]:
    """Points by the degrees of a `rule` on so many pieces of a facet."""
    from iceslide_fem.mechanics import contact  # starts MPI, after which no mpirun runs

    along, across = rule
    with patch.multiple(contact, FACET_DEGREE=along, ACROSS_DEGREE=across):
        yield contact.FACET_PIECES


def known_of(scene: Scene, rule: tuple[int, int]) -> Known:
    """A run of the `scene` with points by that `rule`."""
    with points(rule):
        found = run_of(scene)
    return Known(found.time, found.mu, found.mean, plate_of(found))


def run_of(scene: Scene) -> Slide:
    """A slide on this process."""
    from iceslide_fem.fenics.start import start_petsc
    from scripts.studies.blocks import slid  # starts MPI, too

    start_petsc()
    return slid(scene)


def plate_of(found: Slide) -> float:
    """Displacement of the plate at the end, m."""
    return found.last.current.mechanics.plate_displacement


def taken(scene: Scene, fine: Known) -> Iterator[object]:
    """Steps and processor seconds of a run, and its errors against a `fine` one."""
    found = run_of(scene)
    times = np.linspace(0.0, scene.load.duration, TIMES)
    error = np.interp(times, found.time, found.mu) / np.interp(times, fine.time, fine.mu)
    error = np.abs(error - 1.0)
    yield found.steps
    yield f"{found.seconds:.1f}"
    for value in (error.max(), math.sqrt(np.mean(error**2)), error.mean()):
        yield f"{value:.2%}"
    yield f"{found.mean / fine.mean - 1.0:+.2%}"
    yield f"{plate_of(found) / fine.plate - 1.0:+.2%}"


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
        fine = Known.of(
            reference(folder / f"{CASE}_block", CASE, LOOSE, steps, changes, refinement)
        )
    coarse = [f"numerics.tolerance={LOOSE}", f"numerics.refinement={refinement}"]
    scene = case(CASE, *changes, *coarse)
    head: tuple[str, ...]
    errors = ("steps", "processor s", "largest", "rms", "mean", "of mean mu", "plate")
    if arguments.points:
        head = ("points", *errors)
        table(head, (tuple(of_points(scene, rule, fine)) for rule in rules))
        bulging = case(BULGING, *changes, *coarse)
        most = known_of(bulging, MOST)
        print(f"{BULGING}:")
        table(head, (tuple(of_points(bulging, rule, most)) for rule in rules))
    else:
        head = ("cells x, y (half), z", "unknowns", *errors)
        table(head, (tuple(of_cells(scene, each, fine)) for each in cells))


if __name__ == "__main__":
    main()
