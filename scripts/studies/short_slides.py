"""Slides so short, or meshes so fine, that a block left behind by its friction would have to jump.

The first moments of tread_block at its tolerance of 1e-2: steps, rejected ones, Newton's
iterations, and the largest error of mu(t) against a tolerance of 1e-3 on the same mesh. Beside the
program as it is, without its two remedies: a bound on how far a block may be from its equilibrium
while mechanics is skipped (`coupling.limits.StepLimits.skipped_motion`), and the resultant in the
size of what is not balanced (`rubber.contact_nodes.RESULTANT`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import inf

import numpy as np

from iceslide_fem.coupling.limits import LIMITS, StepLimits
from iceslide_fem.rubber import contact_nodes, tangent
from iceslide_fem.runtime.errors import SimulationStopped
from scripts.studies.blocks import slid
from scripts.studies.common import case, largest, options, table

UNLIMITED = replace(LIMITS, skipped_motion=inf)
VARIANTS = {
    "as it is": (LIMITS, contact_nodes.RESULTANT),
    "mechanics skipped while friction is quiet": (UNLIMITED, contact_nodes.RESULTANT),
    "nodal forces alone": (LIMITS, 0.0),
    "neither remedy": (UNLIMITED, 0.0),
}
MESHES = (("slice", 1.0), ("block", 0.8))
DURATIONS = ("0.1ms", "0.02ms", "0.004ms")
REFERENCE = 1e-3  # tolerance


def set_remedies(variant: str) -> StepLimits:
    """Let blocks that are built from now on have the resultant of `variant`; its limits."""
    limits, counts = VARIANTS[variant]
    contact_nodes.RESULTANT = tangent.RESULTANT = counts
    return limits


def rows(quick: bool) -> Iterator[list[object]]:
    """Rows of the table."""
    for model, refinement in MESHES[:1] if quick else MESHES:
        for duration in DURATIONS[2:] if quick else DURATIONS:
            changes = [f"model={model}", f"numerics.refinement={refinement}"]
            changes.append(f"load.duration={duration}")
            set_remedies("as it is")
            finer = slid(case("tread_block", *changes, f"numerics.tolerance={REFERENCE}"))
            for variant in VARIANTS:
                limits = set_remedies(variant)
                head = [model, f"{finer.last.block.rubber.n_dofs:,}", duration, variant]
                try:
                    run = slid(case("tread_block", *changes), limits=limits)
                except SimulationStopped as reason:
                    yield [*head, str(reason).partition(" of ")[0], "", "", ""]
                    continue
                error = largest(run.mu, np.interp(run.time, finer.time, finer.mu))
                yield [*head, run.steps, run.rejected, run.iterations, f"{1e2 * error:.2f} %"]
    set_remedies("as it is")


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="the shortest slide of one slice")
    arguments = parser.parse_args()
    names = ["model", "unknowns of the rubber", "slide", "variant"]
    table([*names, "steps", "rejected", "iterations", "largest of mu(t)"], rows(arguments.quick))


if __name__ == "__main__":
    main()
