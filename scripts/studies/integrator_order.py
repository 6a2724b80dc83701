"""Step halving for every integrator through all phases: squeezing, melting, saturated.

5 bar and 4 m/s for 5 ms: melting begins at 0.775 ms, saturation at 4.441 ms. Errors are relative
to a much finer run.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from iceslide_fem.film.point import PointResult, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from scripts.studies.common import conditions, options

DURATION = 5e-3  # s
TIMES = (0.7e-3, 4.3e-3, 5e-3)  # s: before melting, while melting, saturated
COLUMNS = ("mu(0.7 ms)", "mu(4.3 ms)", "mu(5 ms)", "melt onset", "saturation")
STEPS = (100, 200, 400, 800, 1600)


def run(integrator: str, steps: int) -> PointResult:
    """The case with `steps` equal steps, cut only where they end on an event."""
    return simulate(
        conditions(5.0, 4.0, DURATION),
        integrator=integrator,
        fixed_step=DURATION / steps,
        tolerance=1e-9,  # here only: how closely steps end on events
        times=TIMES,
    )


def quantities(result: PointResult) -> np.ndarray:
    """The five values of a result in the order of COLUMNS."""
    return np.array([*result.samples[:, 0], result.melt_onset[0], result.saturation[0]])


def main() -> None:
    """Print errors and observed orders."""
    options(__doc__).parse_args()
    exact = quantities(run("sdirk3", 16 * STEPS[-1]))
    for integrator, method in INTEGRATORS.items():
        table = Table("steps", *COLUMNS, title=f"{integrator}, order {method.order}")
        before = np.full(len(COLUMNS), np.nan)
        for steps in STEPS:
            error = np.abs(quantities(run(integrator, steps)) / exact - 1.0)
            order = np.log2(before / error)
            cells = [
                f"{e:.1e} ({o:.2f})" if np.isfinite(o) else f"{e:.1e}"
                for e, o in zip(error, order, strict=True)
            ]
            table.add_row(str(steps), *cells)
            before = error
        Console(width=110).print(table)
    print("Relative errors; in brackets the observed order.")


if __name__ == "__main__":
    main()
