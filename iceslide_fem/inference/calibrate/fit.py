"""Least squares of a calibration: the best parameters, their profiles, and leave-one-out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares
from scipy.stats import chi2, qmc
from scipy.stats import f as fisher

from iceslide_fem.inference.calibrate.problem import Problem
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.runtime.terminal import LongTask

LEVEL = 0.95
STARTS, TRIED = 3, 64  # of fits beside the scene's own, and of places looked at for them
PLACES_SEED = 0
STEP = 1e-5  # of ln p, at which a fit ends
LOOSE = 1e-4  # the same of fits on profiles and without a row, which start near their end
APART = 0.1  # of ln p, from which two fits are not the same
FARTHEST = 2.5  # step along a profile, in standard errors
AT_BOUND = 1e-3  # of ln of the bounds' ratio
HELD = 0.01  # of the variance, by which the sum of squares would fall beyond a bound
OPEN = 0.5  # standard error of ln p from which a direction is not determined
PART = 0.2  # of a direction, from which a parameter belongs to it
CLOSE = 0.005  # of a standard error, at which the end of an interval is found


class Solution(NamedTuple):
    """Parameters z = ln p (p,), residuals (values,), Jacobian (values, p), and sum of squares."""

    z: Array
    residuals: Array
    slope: Array
    squares: float


class Interval(NamedTuple):
    """Where a parameter lies: ends of z, NaN where the profile does not close before its bound.

    profile: z of the parameter and sums of squares of the best of the others, (k, 2).
    """

    low: float
    high: float
    profile: Array


class Fit(NamedTuple):
    """The best parameters and how sure they are.

    variance: of residuals, estimated, or 1 where sigma is known; covariance: of z (p, p); singular:
    values of the Jacobian; directions: of z that belong to them, in columns (p, p); other:
    parameters elsewhere that the data cannot tell from the best ones, or None.
    """

    best: Solution
    variance: float
    covariance: Array
    singular: Array
    directions: Array
    intervals: tuple[Interval, ...]
    other: Array | None


def fit(problem: Problem, level: float = LEVEL) -> Fit:
    """Fit all parameters, with intervals at a `level`. Raises SimulationStopped."""
    solutions = [solve(problem, start) for start in starts(problem)]
    best = min(solutions, key=lambda one: one.squares)
    p, rows = best.z.size, problem.measured.number
    variance = 1.0 if problem.measured.known else best.squares / (rows - p)
    worst = best.squares + variance * p * fisher.ppf(level, p, rows - p)
    other = next(
        (one.z for one in solutions if one.squares < worst and np.ptp(one.z - best.z) > APART), None
    )
    _, singular, directions = np.linalg.svd(best.slope, full_matrices=False)
    # A direction that is not determined is as uncertain as the bounds are wide.
    widest = float((problem.high - problem.low).max())
    least = max(1e-12 * max(singular[0], 1.0), np.sqrt(variance) / widest)
    covariance = (directions.T * (variance / np.maximum(singular, least) ** 2)) @ directions
    ends = []
    with LongTask(p) as task:
        for number in range(p):
            task.show(number, f"profile of {problem.parameters[number].key}")
            ends.append(_interval(problem, best, number, variance, covariance, level))
    return Fit(best, variance, covariance, singular, directions.T, tuple(ends), other)


def starts(problem: Problem) -> list[Array]:
    """The scene's own parameters, and the best of some places spread over the bounds."""
    places = qmc.LatinHypercube(problem.start.size, seed=PLACES_SEED).random(TRIED)
    spread = problem.low + places * (problem.high - problem.low)
    off = (problem.computed(spread) - problem.ln_measured) / problem.scale
    order = np.argsort((off**2).sum(axis=1))
    return [problem.start, *spread[order[:STARTS]]]


def solve(
    problem: Problem,
    start: Array,
    fixed: int | None = None,
    kept: Mask | None = None,
    step: float = STEP,
) -> Solution:
    """The best parameters from `start`, with one `fixed`, for the `kept` values.

    Parameters without effect stay where they are.
    """
    acts = np.any(problem.residuals(start)[1] != 0.0, axis=0)
    free = np.array([i for i in np.flatnonzero(acts) if i != fixed], dtype=int)
    use: Mask | slice = slice(None) if kept is None else kept

    def whole(part: Array) -> Array:
        z = start.copy()
        z[free] = part
        return z

    low, high = problem.low[free], problem.high[free]
    if free.size:
        found = least_squares(
            lambda part: problem.residuals(whole(part))[0][use],
            np.clip(start[free], low + 1e-9 * (high - low), high - 1e-9 * (high - low)),
            jac=lambda part: problem.residuals(whole(part))[1][use][:, free],
            bounds=(low, high), x_scale="jac", xtol=step, ftol=0.1 * step, gtol=None,
        )  # fmt: skip
        start = whole(found.x)
    residuals, slope = problem.residuals(start)
    return Solution(start, residuals, slope, float((residuals[use] ** 2).sum()))


def _interval(
    problem: Problem,
    best: Solution,
    number: int,
    variance: float,
    covariance: Array,
    level: float,
) -> Interval:
    """The interval of a parameter by its profile (Bates and Watts): where the sum of squares of the
    best others rises by variance times F(1, n - p) at the level, chi2(1) where sigma is known.
    """
    free = problem.measured.number - best.z.size
    known = problem.measured.known
    limit = chi2.ppf(level, 1) if known else fisher.ppf(level, 1, free)
    error = float(np.sqrt(covariance[number, number]))
    along = covariance[:, number] / covariance[number, number]
    profile = [(best.z[number], best.squares)]

    def held(found: Solution) -> bool:
        """Whether a bound of another parameter, and not the data, makes the fit worse there."""
        margin = AT_BOUND * (problem.high - problem.low)
        at = (found.z < problem.low + margin) | (found.z > problem.high - margin)
        pull = (found.residuals @ found.slope) ** 2
        pulls = pull > HELD * variance * (found.slope**2).sum(axis=0)
        return bool(np.delete(at & pulls, number).any())

    def end(sign: float, bound: float) -> float:
        last, found = best, {float(best.z[number]): -float(np.sqrt(limit))}

        def excess(z: float) -> float:
            nonlocal last
            if z in found:
                return found[z]
            guess = np.clip(last.z + along * (z - last.z[number]), problem.low, problem.high)
            guess[number] = z
            last = solve(problem, guess, fixed=number, step=LOOSE)
            profile.append((z, last.squares))
            rise = max(last.squares - best.squares, 0.0) / variance
            found[z] = float(np.sqrt(rise) - np.sqrt(limit))
            return found[z]

        near, far = float(best.z[number]), float(best.z[number])
        step = min(np.sqrt(limit) * error, FARTHEST * max(error, 0.02), 1.0)
        while far != bound:
            near, far = far, sign * min(sign * far + step, sign * bound)
            if excess(far) > 0.0:
                closed = float(brentq(excess, near, far, xtol=CLOSE * min(error, 1.0)))
                return float("nan") if held(last) else closed
        return float("nan")

    low, high = end(-1.0, problem.low[number]), end(1.0, problem.high[number])
    return Interval(low, high, np.array(sorted(profile)))


def leave_one_out(problem: Problem, best: Solution) -> Array:
    """Residuals (values,) of each row under the parameters that fit all other rows best."""
    row, rows = problem.row_of_value, problem.measured.number
    found = np.empty(best.residuals.size)
    with LongTask(rows) as task:
        for number in range(rows):
            task.show(number, f"fit without row {number + 1}")
            own = row == number
            found[own] = solve(problem, best.z, kept=~own, step=LOOSE).residuals[own]
    return found


def undetermined(found: Fit) -> list[tuple[Index, Array, float]]:
    """Directions of z that the data leave open: their parameters, exponents, and standard error.

    Open is a direction whose standard error of ln p is above `OPEN`.
    """
    errors = np.sqrt(found.variance) / np.maximum(found.singular, 1e-300)
    result = []
    for number, error in enumerate(errors):
        if error < OPEN:
            continue
        direction = found.directions[:, number]
        part = np.flatnonzero(np.abs(direction) > PART)
        result.append((part, direction[part], float(error)))
    return result
