"""Calibration against known parameters: estimates, intervals, how often they hold the truth.

Rows are those of `cold_point` at known parameters of dry friction, with noise of mu: 4 speeds, 2
pressures, 4 temperatures, 20 mm of sliding. `known` fits one set and prints parameters, intervals
and seconds; `coverage` fits --sets sets, on this design and on one near the melting point, and
counts how often 95 % intervals by profiles, and by the Jacobian alone, hold the truth. `tests`
counts how often the test behind these profiles does: with one parameter held at its truth the best
sum of squares rises by no more than its limit. It needs no search for ends.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import t as student

from iceslide_fem.inference.calibrate.fit import LEVEL, Fit, fit, leave_one_out, solve, starts
from iceslide_fem.inference.calibrate.measured import Measured
from iceslide_fem.inference.calibrate.output import rms
from iceslide_fem.inference.calibrate.problem import Fitted, Problem, fitted
from iceslide_fem.runs.many_points import Rows, friction
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene
from iceslide_fem.scene.variation import with_values
from scripts.studies.common import case, options, table

TRUTH = {"film.dry_stress": 0.45e6, "film.dry_softening": 13.5, "film.dry_residual": 0.5}
START = {"film.dry_stress": 0.3e6, "film.dry_softening": 8.0, "film.dry_residual": 1.0}
BOUNDS = {
    "film.dry_stress": "10kPa:10MPa",
    "film.dry_softening": "1K:100K",
    "film.dry_residual": "0.02K:5K",
}
SPEEDS, PRESSURES = (0.03, 0.3, 1.0, 3.0), (1.5e5, 3e5)
DESIGNS = {"-20 to -2": (-20.0, -10.0, -5.0, -2.0), "-10 to -2": (-10.0, -7.0, -5.0, -2.0)}
LENGTH, NOISE, SEED = 20e-3, 0.05, 7


def design(temperatures: tuple[float, ...]) -> Rows:
    """All combinations of speeds, pressures and temperatures (degC)."""
    kelvin = ZERO_CELSIUS + np.array(temperatures)
    v, p, T = map(np.ravel, np.meshgrid(SPEEDS, PRESSURES, kelvin, indexing="ij"))
    return Rows(p, v, T, LENGTH / v)


def known_problem(temperatures: tuple[float, ...], noise: Array | None = None) -> Problem:
    """Rows of the true parameters with relative `noise`, by default that of one seed."""
    scene, rows = case("cold_point"), design(temperatures)
    true = friction([with_values(scene, TRUTH)], rows).mu_mean[0]
    if noise is None:
        noise = NOISE * np.random.default_rng(SEED).standard_normal(true.size)
    mu = true * (1.0 + noise)
    measured = Measured(rows, mu, np.full(mu.size, NOISE), None, False, "study",
                        ("speed", "pressure", "temperature", "duration"))  # fmt: skip
    start = with_values(scene, START)
    return Problem(start, measured, parameters(start), "mu_mean")


def parameters(scene: Scene) -> tuple[Fitted, ...]:
    """The three parameters of dry friction."""
    return fitted(scene, BOUNDS)


def known() -> Iterator[tuple[object, ...]]:
    """Parameters of one set with their intervals."""
    problem = known_problem(DESIGNS["-20 to -2"])
    begun = perf_counter()
    found = fit(problem)
    left_out = leave_one_out(problem, found.best)
    seconds = perf_counter() - begun
    errors = np.sqrt(np.diag(found.covariance))
    for one, z, error, interval in zip(
        problem.parameters, found.best.z, errors, found.intervals, strict=True
    ):
        ends = (f"{np.exp(end):.5g}" for end in (interval.low, interval.high))
        yield one.key, f"{TRUTH[one.key]:g}", f"{np.exp(z):.5g}", f"{error:.5f}", *ends
    off, unseen = found.best.residuals * problem.scale, left_out * problem.scale
    print(f"sum of squares {(off**2).sum():.6f}, rms {rms(off):.5f}, leave-one-out "
          f"{rms(unseen):.5f}, {problem.points} points, {seconds:.1f} s")  # fmt: skip


def holds(problem: Problem, found: Fit) -> tuple[list[bool], list[bool]]:
    """Whether profiles, and linear intervals, hold the truth of each parameter."""
    errors = np.sqrt(np.diag(found.covariance))
    width = student.ppf(0.975, problem.measured.number - len(errors)) * errors
    by_profile, by_line = [], []
    for number, one in enumerate(problem.parameters):
        true, z, ends = np.log(TRUTH[one.key]), found.best.z[number], found.intervals[number]
        by_profile.append(not (ends.low > true or ends.high < true))  # an open end holds all
        by_line.append(bool(abs(true - z) <= width[number]))
    return by_profile, by_line


def coverage(sets: int, names: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """How often intervals hold the truth, of `sets` sets of some designs."""
    for name in names:
        temperatures = DESIGNS[name]
        rng = np.random.default_rng(SEED)
        both = []
        for _ in range(sets):
            noise = NOISE * rng.standard_normal(len(SPEEDS) * len(PRESSURES) * len(temperatures))
            problem = known_problem(temperatures, noise)
            both.append(holds(problem, fit(problem)))
        profiles, lines = np.array(both).sum(axis=0)
        for one, by_profile, by_line in zip(TRUTH, profiles, lines, strict=True):
            yield name, one, sets, by_profile, by_line


def tests(sets: int, names: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """How often the truth of each parameter passes the test of its profile."""
    truth = np.log(list(TRUTH.values()))
    for name in names:
        temperatures = DESIGNS[name]
        rng, passed = np.random.default_rng(SEED), np.zeros(truth.size, dtype=int)
        rows = len(SPEEDS) * len(PRESSURES) * len(temperatures)
        limit = fisher.ppf(LEVEL, 1, rows - truth.size)
        for _ in range(sets):
            problem = known_problem(temperatures, NOISE * rng.standard_normal(rows))
            best = best_of(problem, [*starts(problem), truth])
            variance = best / (rows - truth.size)
            for number in range(truth.size):
                others = np.where(np.arange(truth.size) == number, truth, problem.start)
                held = best_of(problem, [truth, others], number)
                passed[number] += (held - best) / variance <= limit
        for one, count in zip(TRUTH, passed, strict=True):
            yield name, one, sets, count


def best_of(problem: Problem, starting: Sequence[Array], fixed: int | None = None) -> float:
    """The least sum of squares of fits from some starts."""
    return min(solve(problem, start, fixed).squares for start in starting)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument(
        "--questions", nargs="+", choices=("known", "coverage", "tests"), default=["known"]
    )
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--designs", nargs="+", choices=[*DESIGNS], default=[*DESIGNS])
    parser.add_argument("--quick", action="store_true", help="few sets")
    given: argparse.Namespace = parser.parse_args()
    if "known" in given.questions:
        table(("parameter", "truth", "estimate", "error of ln", "from", "to"), list(known()))
    if "coverage" in given.questions:
        sets = 2 if given.quick else given.sets
        head = ("temperatures, °C", "parameter", "sets", "profiles hold", "linear ones hold")
        table(head, coverage(sets, given.designs))
    if "tests" in given.questions:
        sets = 2 if given.quick else given.sets
        head_of_tests = ("temperatures, °C", "parameter", "sets", "pass")
        table(head_of_tests, tests(sets, given.designs))


if __name__ == "__main__":
    main()
