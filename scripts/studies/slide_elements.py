"""Which element? Slides with a film by fully integrated Q2 and by the default, which locks less:
error of mu(t) and of the plate's displacement, work.

Slides the thesis's blocks at 1 and 5 bar on several meshes and compares mu(t) with that of the
default on a mesh at least twice as fine, the last of each table. --model block is
3-D. Prints tables in Markdown. Times are of the processor, on one process, without compilation.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.mechanics.block import build_block
from iceslide_fem.mechanics.element import WHOLE_DEGREE, Energy, stored_energy
from iceslide_fem.mechanics.press import press
from scripts.studies.blocks import Slide, slid
from scripts.studies.common import case, options, table
from scripts.studies.press_elements import DEFAULT, fully_integrated

CASES = ("thesis_1bar", "thesis_5bar")
ELEMENTS: dict[str, Energy] = {
    "Q2": fully_integrated(WHOLE_DEGREE["hexahedron"]),
    DEFAULT: stored_energy,
}
REFINEMENTS = {"slice": (0.5, 0.7, 1.0, 2.0), "block": (0.5, 0.7, 1.0, 2.0)}
QUICK = (0.35, 0.7)
TIMES = 1000  # at which mu(t) is compared


class Found(NamedTuple):
    """A slide, its unknowns of rubber, and the displacement of the plate after the press (m)."""

    unknowns: int
    pressed: float
    slide: Slide


def found(name: str, model: str, refinement: float, energy: Energy) -> Found:
    """Press the scene's block, then slide another from the start, at a tolerance of 1e-2."""
    scene = case(
        name, f"model={model}", f"numerics.refinement={refinement}", "numerics.tolerance=1e-2"
    )
    block = build_block(scene, MPI.COMM_SELF, energy)
    press(block, lambda _: None)
    pressed = block.equilibrium.plate_displacement()
    slide = slid(scene, build_block(scene, MPI.COMM_SELF, energy))
    return Found(block.rubber.n_dofs, pressed, slide)


def rows(name: str, model: str, refinements: tuple[float, ...]) -> Iterator[tuple[object, ...]]:
    """Of one case: the finest mesh first, as errors are told against it."""
    finest = max(refinements)
    exact = found(name, model, finest, stored_energy)
    times = np.linspace(0.0, exact.slide.time[-1], TIMES)
    mu = np.interp(times, exact.slide.time, exact.slide.mu)
    for element, energy in ELEMENTS.items():
        for refinement in refinements:
            known = energy is stored_energy and refinement == finest
            one = exact if known else found(name, model, refinement, energy)
            slide = one.slide
            error = np.interp(times, slide.time, slide.mu) / mu - 1.0
            yield (
                element, refinement, one.unknowns, slide.steps, slide.iterations,
                f"{slide.seconds:.1f}", f"{one.pressed / exact.pressed - 1.0:+.2%}",
                f"{np.abs(error).max():.2%}", f"{np.sqrt(np.mean(error**2)):.2%}",
                f"{slide.mean / exact.slide.mean - 1.0:+.2%}",
            )  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="two coarse meshes")
    parser.add_argument("--model", choices=tuple(REFINEMENTS), default="slice")
    parser.add_argument("--cases", nargs="+", default=CASES)
    parser.add_argument("--refinements", type=float, nargs="+")
    asked = parser.parse_args()
    start_petsc()
    refinements = tuple(asked.refinements or (QUICK if asked.quick else REFINEMENTS[asked.model]))
    head = ("element", "mesh x", "unknowns of rubber", "steps", "iterations", "s", "plate pressed")
    for name in asked.cases:
        print(f"\n### {name}, {asked.model}\n")
        table(
            (*head, "largest of mu(t)", "rms", "of mean mu"), rows(name, asked.model, refinements)
        )


if __name__ == "__main__":
    main()
