"""Does the error of mu(t) stay below the tolerance? Many points, by ice, integrator and tolerance.

600 conditions of compound B (1 to 5 bar, 0.5 to 8 m/s, -20 to -1 degC, 7 ms), mu at 141 times of
each, against the same points at a tolerance of 1e-6. Prints the largest and the mean of the largest
errors of each condition, relative to the tolerance, and steps on average. --quick takes 60 of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from iceslide_fem.film.point import Conditions, simulate
from scripts.studies.common import conditions, options, table

DURATION = 7e-3  # s
TIMES = np.linspace(0.0, DURATION, 141)
ICES, INTEGRATORS = ("column", "half-space"), ("sdirk2", "sdirk3")
TOLERANCES = (1e-2, 1e-3, 1e-4)
EXACT = 1e-6


def grid(quick: bool) -> Conditions:
    """10 pressures, 10 speeds and 6 temperatures of the ice; with `quick` a tenth of them."""
    axes = np.meshgrid(
        np.geomspace(1.0, 5.0, 10), np.linspace(0.5, 8.0, 10), np.linspace(-20.0, -1.0, 6)
    )
    bar, speed, celsius = (axis.ravel()[:: 10 if quick else 1] for axis in axes)
    return conditions(bar, speed, DURATION, celsius)


def rows(points: Conditions) -> Iterator[tuple[str, ...]]:
    """Errors in units of the tolerance."""
    for ice in ICES:
        exact = simulate(points, ice, EXACT, times=TIMES).samples
        for integrator, tolerance in product(INTEGRATORS, TOLERANCES):
            found = simulate(points, ice, tolerance, integrator, times=TIMES)
            error = np.abs(found.samples / exact - 1.0).max(axis=0) / tolerance
            yield (
                ice, integrator, f"{tolerance:.0e}", f"{error.max():.2f}", f"{error.mean():.2f}",
                f"{found.steps.mean():.0f}",
            )  # fmt: skip


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the conditions")
    arguments = parser.parse_args()
    head = ("ice", "integrator", "tolerance", "largest / tolerance", "mean / tolerance", "steps")
    table(head, rows(grid(arguments.quick)))


if __name__ == "__main__":
    main()
