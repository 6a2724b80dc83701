"""The point level at its default tolerance against the reference values, with deviations.

The values come from two independent solvers of the same model and are rounded to the digits
shown.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from iceslide_fem.film.point import simulate
from scripts.studies.common import conditions, options

TIMES = (0.8e-3, 5e-3, 7e-3)  # s
QUANTITIES = ("onset, ms", "peak mu", "mu(0.8 ms)", "mu(5 ms)", "mu(7 ms)", "saturation, ms")
# (ice, bar, m/s): values in the order of QUANTITIES, as printed; "-" where there is none
REFERENCE = {
    ("column", 1, 3): "3.297 0.5307 0.3166 0.306 0.255 -",
    ("column", 1, 4): "1.681 0.540 0.4222 0.249 0.231 -",
    ("column", 5, 3): "1.535 0.155 0.1200 0.068 0.0635 -",
    ("column", 5, 4): "0.776 0.1581 0.1516 0.0426 0.0319 4.44",
    ("half-space", 1, 3): "- - - 0.261 0.235 -",
    ("half-space", 5, 3): "- - - 0.0661 0.0625 -",
    ("half-space", 5, 4): "- - - 0.0393 - 4.17",
}


def values(ice: str, pressure: float, speed: float) -> np.ndarray:
    """The quantities by the point level."""
    result = simulate(conditions(pressure, speed), ice=ice, times=TIMES)
    onset, saturation = 1e3 * result.melt_onset[0], 1e3 * result.saturation[0]
    return np.array([onset, result.mu_peak[0], *result.samples[:, 0], saturation])


def main() -> None:
    """Print results and deviations."""
    options(__doc__).parse_args()
    table = Table("ice", "bar", "m/s", *QUANTITIES)
    largest = beyond = 0.0
    for (ice, pressure, speed), printed in REFERENCE.items():
        cells = []
        for value, text in zip(values(ice, pressure, speed), printed.split(), strict=True):
            if text == "-":
                cells.append("-" if np.isnan(value) else f"{value:.4g}")
                continue
            number, rounding = float(text), 0.5 * 10.0 ** -len(text.partition(".")[2])
            deviation = value / number - 1.0
            largest = max(largest, abs(deviation))
            beyond = max(beyond, abs(deviation) - rounding / number)
            cells.append(f"{value:.4g} ({deviation:+.2%})")
        table.add_row(ice, str(pressure), str(speed), *cells)
    Console(width=140).print(table)
    print(f"In brackets: deviation from the reference value; the largest is {largest:.2%},")
    print(f"and {beyond:.2%} beyond what the reference's last digit can say.")


if __name__ == "__main__":
    main()
