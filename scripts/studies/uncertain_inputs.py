"""What uncertain inputs mean for mu: points by sampling, and slices by few runs and many points.

`points` prints mean, standard deviation and quantiles of `thesis_1bar` for several numbers of
samples. `slices` draws 8 of --reference slices again and again, and prints by how much the ends of
the band miss those of all slices, plain and with points as control variate, in parts of its width.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from time import perf_counter

import numpy as np

from iceslide_fem.inference.uncertainty.case import UncertaintyCase
from iceslide_fem.inference.uncertainty.command import compute
from iceslide_fem.inference.uncertainty.propagate import Spread
from scripts.studies.common import ROOT, options, table

INPUTS = {
    "film.k_scale": "1+-10%",
    "film.D_scale": "1+-10%",
    "film.H_V_scale": "1+-10%",
    "ice.temperature": "-4degC+-0.5K",
    "water.viscosity": "+-5%",
    "ice.conductivity": "+-5%",
}
ENDS = (0.025, 0.975)


def spread(model: str, **more: object) -> tuple[Spread, float]:
    """The spread of `thesis_1bar` on a level, and the seconds it took."""
    change = {"model": model}
    if model == "slice":
        change["numerics.tolerance"] = "1e-2"
    values = {"source": ROOT / "cases" / "thesis_1bar.toml", "input": INPUTS, "change": change}
    begun = perf_counter()
    found = compute(UncertaintyCase.of({**values, **more}))
    return found, perf_counter() - begun


def points() -> Iterator[tuple[object, ...]]:
    """The spread of a point."""
    for samples in (256, 1024, 4096, 16384):
        found, seconds = spread("point", samples=samples)
        low, high = np.quantile(found.mu, ENDS)
        yield (
            samples, f"{found.mu.mean():.6f}", f"{found.mu.std():.6f}", f"{low:.6f}",
            f"{high:.6f}", f"{seconds:.2f}",
        )  # fmt: skip


def slices(reference: int, draws: int) -> Iterator[tuple[object, ...]]:
    """Errors of the band's ends from 8 slices, plain and with points."""
    found, seconds = spread("slice", runs=reference)
    runs = found.runs
    assert runs is not None
    exact = np.quantile(found.mu, ENDS)
    width = exact[1] - exact[0]
    print(f"{reference} slices: mean {runs.mu.mean():.4f}, std {runs.mu.std(ddof=1):.4f}, "
          f"correlation {runs.correlation:.4f}, {seconds:.0f} s")  # fmt: skip
    rng, points_mu = np.random.default_rng(0), found.samples.mu
    plain, by_points = [], []
    for _ in range(draws):
        some = rng.choice(reference, 8, replace=False)
        mu, near = runs.mu[some], runs.points[some]
        middle, deviation = mu.mean(), mu.std(ddof=1)
        plain.append(middle + 1.96 * deviation * np.array([-1.0, 1.0]) - exact)
        slope, offset = np.polyfit(near, mu, 1)
        by_points.append(np.quantile(offset + slope * points_mu, ENDS) - exact)
    for name, errors in (("8 slices alone", plain), ("8 slices and points", by_points)):
        off = np.sqrt(np.mean(np.square(errors), axis=0)) / width
        yield name, *(f"{one:.1%}" for one in off)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--questions", nargs="+", choices=("points", "slices"), default=["points"])
    parser.add_argument("--reference", type=int, default=40, help="slices")
    parser.add_argument("--quick", action="store_true", help="few slices")
    given: argparse.Namespace = parser.parse_args()
    if "points" in given.questions:
        table(("samples", "mean", "std", "2.5 %", "97.5 %", "s"), points())
    if "slices" in given.questions:
        reference = 9 if given.quick else given.reference
        table(("band from", "lower end", "upper end"), list(slices(reference, 200)))


if __name__ == "__main__":
    main()
