"""Figures of the errata of the thesis (docs/explanation/data.md): Poisson's ratio and
(5.17).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from iceslide_fem.film.point import simulate
from iceslide_fem.reference import squeeze_coefficient, squeezed_film
from iceslide_fem.scene.materials import (
    BAR,
    COMPOUNDS,
    CONTACT_TABLES,
    WATER_VISCOSITY,
    MooneyRivlin,
)
from scripts.studies.common import conditions, options, table

SPEED, INITIAL_HEIGHT = 3.0, 70e-9  # m/s, m
PUBLISHED_TIME, PUBLISHED_MU = 0.8e-3, 0.12  # s; figure 40, 5 bar


def stiffness(name: str, material: MooneyRivlin) -> tuple[str, ...]:
    """Bulk modulus (MPa), Poisson's ratio and Young's modulus (MPa) of a material."""
    bulk, young = 1e-6 * material.bulk_modulus, 1e-6 * material.youngs_modulus
    return name, f"{bulk:.1f}", f"{material.poissons_ratio:.4f}", f"{young:.3f}"


def early_mu(bar: float, k: float, time: float, below_asperities: bool) -> float:
    """mu before melting, with the rate of (5.17), or with that of (5.16), 1/k times faster."""
    pressure = bar * BAR
    D = float(CONTACT_TABLES["B"](pressure).D)
    rate = squeeze_coefficient(pressure, D) / (k if below_asperities else 1.0)
    height = squeezed_film(INITIAL_HEIGHT, rate, time)
    return float(k * WATER_VISCOSITY * SPEED / (height * pressure))


def main() -> None:
    """Print both tables."""
    options(__doc__).parse_args()
    B = COMPOUNDS["B"]
    printed = MooneyRivlin.from_nu(B.C10, B.C01, 0.495)
    rows = [stiffness("K = 2/D1", B), stiffness("nu = 0.495", printed)]
    table(("compound B", "K, MPa", "nu", "E, MPa"), rows)

    print()
    found = []
    for bar in (1.0, 5.0):
        here = conditions(bar, SPEED)
        k = float(here.k[0])
        # K3 goes with 1/D^2, and nothing else does
        faster = here._replace(D=here.D * np.sqrt(here.k))
        for name, point in (("(5.17)", here), ("(5.16)", faster)):
            result = simulate(point)
            early = early_mu(bar, k, PUBLISHED_TIME, name == "(5.16)")
            onset, peak = f"{1e3 * result.melt_onset[0]:.2f}", f"{result.mu_peak[0]:.3f}"
            mean = f"{result.mu_mean[0]:.4f}"
            found.append((f"{bar:g}", f"{k:.3f}", name, f"{early:.4f}", onset, peak, mean))
    head = (
        "bar",
        "k",
        "rate of",
        "mu at 0.8 ms, unmolten",
        "melts, ms",
        "peak mu",
        "mean mu, 7 ms",
    )
    table(head, found)

    def lack(k: float) -> float:
        return early_mu(5.0, k, PUBLISHED_TIME, True) - PUBLISHED_MU

    needed = brentq(lack, 0.01, 1.0)
    print(f"\nmu = {PUBLISHED_MU} at 0.8 ms and 5 bar with (5.16) needs k = {needed:.3f}")


if __name__ == "__main__":
    main()
