"""Which sipes rub most on cold and on warmer ice, and what a compound does beside them.

Number, depth and width of straight sipes in the slice of the case siped_tread are chosen by
SciPy's DIRECT search (D. R. Jones et al., J. Optim. Theory Appl. 79 (1993) 157) for the largest
mean ln(mu) of two temperatures, in so many slices of each. The best design, and the block without
sipes, are then computed on a finer mesh at the tolerance of the case. The parts of the variance of
ln(mu): of the designs that were computed, and of the compound, whose contact, modulus and dry
stress are spread; those are points at many samples (`iceslide uncertainty` shows by how much points
and slices go together).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import direct
from scipy.stats import qmc

from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.distribution import read_distribution
from iceslide_fem.scene.variation import with_values
from iceslide_fem.workflow.sweep.processes import compute_all
from iceslide_fem.workflow.sweep.table import DONE
from scripts.studies.common import ROOT, options, table

CASE = ROOT / "cases" / "siped_tread.toml"
CELSIUS = (-10.0, -2.0)
NUMBERS = (0.0, 4.99)  # of sipes, rounded down
DEPTHS = (2e-3, 7e-3)  # m
WIDTHS = (0.3e-3, 0.8e-3)  # m
QUICK = ("numerics.tolerance=2e-2", "numerics.refinement=0.5")
FINE = ("numerics.tolerance=1e-2", "numerics.refinement=1")
COMPOUND = {"film.k_scale": "~10%", "film.H_V_scale": "~10%", "film.D_scale": "~10%"}
NONE = 10.0  # -ln(mu) of a design that finds no equilibrium


class Design(NamedTuple):
    """Number of sipes, their depth and width (m)."""

    number: int
    depth: float
    width: float

    @classmethod
    def at(cls, x: Array) -> Design:
        """From the numbers of the search."""
        if x[0] < 1.0:
            return cls(0, DEPTHS[0], WIDTHS[0])
        return cls(int(x[0]), round(float(x[1]), 4), round(float(x[2]), 5))

    def __str__(self) -> str:
        if not self.number:
            return "none"
        return f"{self.number} of {1e3 * self.depth:.1f} mm, {1e3 * self.width:.2f} mm wide"

    def changes(self, celsius: float) -> list[str]:
        """Overrides of the case."""
        sipes = [
            f"rubber.sipes={self.number}", f"rubber.sipe_depth={self.depth} m",
            f"rubber.sipe_width={self.width} m",
        ] if self.number else ["rubber.sipes=0"]  # fmt: skip
        return ["model=slice", *sipes, f"ice.temperature={celsius} degC"]


def mu_of(designs: Sequence[Design], more: Sequence[str]) -> Array:
    """Mean mu (designs, temperatures), NaN where a slice does not end."""
    scenes = {
        f"d{number}_{place}": load_scene(CASE, [*one.changes(celsius), *more])
        for number, one in enumerate(designs)
        for place, celsius in enumerate(CELSIUS)
    }
    with tempfile.TemporaryDirectory() as folder:
        outcomes = compute_all(Path(folder), scenes)
    for name, outcome in outcomes.items():
        if outcome.status != DONE:
            print(f"{scenes[name].rubber.sipes} sipes: {outcome.reason}", flush=True)
    mu = [one.summary["mu_mean"] if one.status == DONE else np.nan for one in outcomes.values()]
    return np.reshape(mu, (len(designs), len(CELSIUS)))


def compound_variance(scene: Scene, samples: int) -> float:
    """Variance of the mean over temperatures of ln(mu) of points by the compound."""
    point = scene.model_copy(update={"model": "point"})
    spreads = [read_distribution(point, key, text) for key, text in COMPOUND.items()]
    drawn = qmc.Sobol(len(spreads), seed=9).random_base2(int(np.log2(samples)))
    columns = np.column_stack([one.at(drawn[:, i]) for i, one in enumerate(spreads)])
    logs = []
    for celsius in CELSIUS:
        scenes = [
            with_values(
                point,
                dict(zip(COMPOUND, map(float, row), strict=True))
                | {"ice.temperature": ZERO_CELSIUS + celsius},
            )
            for row in columns
        ]
        logs.append(np.log(friction(scenes).mu_mean[:, 0]))
    return float(np.var(np.mean(logs, axis=0)))


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--evaluations", type=int, default=60)
    given: argparse.Namespace = parser.parse_args()
    begun, seen = time.perf_counter(), dict[Design, Array]()

    def cost(x: Array) -> float:
        design = Design.at(x)
        if design not in seen:
            seen[design] = mu_of([design], QUICK)[0]
        worth = float(np.log(seen[design]).mean())
        return -worth if np.isfinite(worth) else NONE

    direct(cost, [NUMBERS, DEPTHS, WIDTHS], maxfun=given.evaluations, vol_tol=0.0, len_tol=0.0)
    searched = time.perf_counter() - begun
    worth = {one: float(np.log(mu).mean()) for one, mu in seen.items() if np.isfinite(mu).all()}
    ranked = sorted(worth, key=lambda one: -worth[one])
    plain = Design(0, DEPTHS[0], WIDTHS[0])
    best = ranked[0]
    shown = [*dict.fromkeys([plain, *ranked[:3], ranked[-1]])]
    coarse, fine = mu_of(shown, QUICK), mu_of(shown, FINE)
    head = ("sipes", *(f"mu at {c:g} °C" for c in CELSIUS), "over none", "finer mesh: over none")
    rows = [
        (
            one, *(f"{mu:.4f}" for mu in fine[i]),
            *(f"{np.exp(np.log(each[i] / each[0]).mean()) - 1.0:+.2%}" for each in (coarse, fine)),
        )
        for i, one in enumerate(shown)
    ]  # fmt: skip
    table(head, rows)
    pattern = float(np.var(list(worth.values())))
    compound = compound_variance(load_scene(CASE, ["model=slice"]), 512)
    whole = pattern + compound
    print(
        f"{len(seen)} designs, {len(seen) - len(worth)} of them without an end, in {searched:.0f} "
        f"s; best: {best}. Of the variance of ln(mu) {pattern / whole:.0%} is of the designs, "
        f"{compound / whole:.0%} of the compound ({', '.join(COMPOUND.values())} of k, H_V, D)."
    )


if __name__ == "__main__":
    main()
