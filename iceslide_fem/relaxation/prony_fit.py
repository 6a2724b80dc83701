"""The Prony series of a master curve: non-negative least squares, arms by cross-validation.

    E'  = E_inf + sum E_i (w tau_i)^2 / (1 + (w tau_i)^2)
    E'' =         sum E_i  w tau_i    / (1 + (w tau_i)^2)

or, of relaxation, E(t) = E_inf + sum E_i exp(-t / tau_i) with t = 1 / w.

E_inf and E_i >= 0 minimise the squared relative errors (C. L. Lawson, R. J. Hanson,
*Solving Least Squares Problems*, 1974, chapter 23). The initial tau_i come from a fit on a fine
grid of times, with neighbours merged. They are then fitted, too; E_inf and E_i are eliminated in
this fit (variable projection, G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.runtime.arrays import Array

MOST_ARMS = 20
FOLDS = 5
IN_VAIN = 4  # number of further arms tried without improvement
PER_DECADE = 8  # times of the fine grid
# Range of resolvable times: half a decade beyond the frequencies on either side.
BEYOND = 10.0**0.5
RIDGE = 1e-12  # of each diagonal term, because neighbouring times are nearly dependent
SMALLEST_ARM = 1e-6  # of the instantaneous modulus; smaller arms are dropped
SMALLEST_LONG_TERM = 1e-5  # of the largest storage modulus: rubber does not flow


class Fit(NamedTuple):
    """A series and its instantaneous modulus (Pa).

    flows: whether the data alone give no long-term modulus.
    """

    prony: Prony
    instantaneous: float
    flows: bool


class _Data(NamedTuple):
    """Angular frequencies (rad/s) and moduli (Pa); arrays (rows,); loss: None of relaxation."""

    frequency: Array
    storage: Array
    loss: Array | None

    def at(self, rows: Array) -> _Data:
        """Some of the rows."""
        loss = None if self.loss is None else self.loss[rows]
        return _Data(self.frequency[rows], self.storage[rows], loss)

    @property
    def values(self) -> Array:
        """Storage above loss moduli, (2 rows,); (rows,) of relaxation."""
        return self.storage if self.loss is None else np.concatenate([self.storage, self.loss])

    def columns(self, times: Array) -> Array:
        """Moduli of unit arms with `times`, the long-term one first: (values, 1 + arms)."""
        ones = np.ones((len(self.frequency), 1))
        if self.loss is None:
            return np.hstack([ones, np.exp(-1.0 / (self.frequency[:, None] * times))])
        turned = 1j * self.frequency[:, None] * times
        arms = turned / (1.0 + turned)
        return np.block([[ones, arms.real], [0.0 * ones, arms.imag]])


def fit(frequency: Array, storage: Array, loss: Array | None, most: int = MOST_ARMS) -> Fit:
    """The series of moduli (Pa) at angular frequencies (rad/s), arrays (rows,) in any order.

    Without `loss`, of relaxation: storage is the modulus at the time 1 / frequency.

    The number of arms, up to `most`, is the smallest with a cross-validation error within one
    standard error of the least (T. Hastie, R. Tibshirani, J. Friedman, *The Elements of Statistical
    Learning*, 2nd ed., 2009, section 7.10).
    """
    data = _Data(frequency, storage, loss)
    times = _times(data, most)
    moduli, _ = spectrum(*data, times)
    total = float(moduli.sum())
    kept = moduli[1:] > SMALLEST_ARM * total
    kept[np.argmax(moduli[1:])] = True
    arms = np.maximum(moduli[1:][kept], SMALLEST_ARM * total)
    order = np.argsort(times[kept])
    instantaneous = float(moduli[0] + arms.sum())
    prony = Prony(tuple((arms[order] / instantaneous).tolist()), tuple(times[kept][order].tolist()))
    return Fit(prony, instantaneous, bool(moduli[0] <= _floor(storage)))


def fine_grid(frequency: Array) -> Array:
    """Times (s) in equal ratios, resolvable by angular frequencies (rad/s)."""
    fastest, slowest = 1.0 / (BEYOND * frequency.max()), BEYOND / frequency.min()
    return np.geomspace(fastest, slowest, 1 + round(PER_DECADE * np.log10(slowest / fastest)))


def spectrum(
    frequency: Array, storage: Array, loss: Array | None, times: Array
) -> tuple[Array, Array]:
    """E_inf and E_i (Pa, (1 + arms,)) of arms with `times` (s), and relative errors (2 rows,).

    Errors of the storage moduli come first, then those of the loss moduli; (rows,) of relaxation.
    """
    from scipy.optimize import nnls  # takes long to import

    data = _Data(frequency, storage, loss)
    matrix = data.columns(times) / data.values[:, None]
    floor = _floor(storage)
    asked = 1.0 - floor * matrix[:, 0]
    # Cholesky factor of the normal equations: small even for many rows.
    normal = matrix.T @ matrix
    normal += np.diag(RIDGE * np.diag(normal))
    factor = np.linalg.cholesky(normal)
    right = np.linalg.solve(factor, matrix.T @ asked)
    moduli, _ = nnls(factor.T, right, maxiter=100 * len(right))
    moduli[0] += floor
    return moduli, matrix @ moduli - 1.0


def _floor(storage: Array) -> float:
    return SMALLEST_LONG_TERM * float(storage.max())


def _times(data: _Data, most: int) -> Array:
    """Times (s) of the arms; their number is chosen as in `fit`.

    A fold of the cross-validation has every fifth frequency. Without it the moduli are fitted
    again, but not the times.
    """
    rows = len(data.frequency)
    fold = np.argsort(np.argsort(data.frequency, kind="stable")) % min(FOLDS, rows)
    joined = _joined(data, min(most, max(1, rows - 1)))
    found, errors = [], []
    for start in joined:
        times = _fitted(data, start)
        squares = np.empty(rows)
        for left_out in range(fold.max() + 1):
            out = fold == left_out
            moduli, _ = spectrum(*data.at(~out), times)
            squares[out] = _squares(data.at(out), times, moduli)
        found.append(times)
        errors.append(squares)
        means = [each.mean() for each in errors]
        if len(means) - int(np.argmin(means)) > IN_VAIN:
            break
    best = int(np.argmin(means))
    sure = means[best] + errors[best].std() / rows**0.5
    return next(times for times, mean in zip(found, means, strict=True) if mean <= sure)


def _squares(data: _Data, times: Array, moduli: Array) -> Array:
    """Sum of squared relative errors of a row's moduli, (rows,)."""
    off = data.columns(times) @ moduli / data.values - 1.0
    return np.asarray((off.reshape(-1, len(data.frequency)) ** 2).sum(axis=0))


def _fitted(data: _Data, start: Array) -> Array:
    """Times (s) near `start` with the least errors."""
    from scipy.optimize import least_squares  # takes long to import

    grid = fine_grid(data.frequency)
    low, high = np.log(grid[0]), np.log(grid[-1])
    inside = np.clip(np.log(start), low + 1e-9, high - 1e-9)
    found = least_squares(
        lambda logs: spectrum(*data, np.exp(logs))[1], inside, bounds=(low, high), max_nfev=15
    )
    return np.sort(np.exp(found.x))


def _joined(data: _Data, most: int) -> list[Array]:
    """Times of 1, 2, ... up to `most` arms, by merging neighbours of the fine grid.

    The two arms are merged whose moduli change least at the frequencies between them.
    """
    grid = fine_grid(data.frequency)
    moduli, _ = spectrum(*data, grid)
    kept = moduli[1:] > 0.0
    logs, weights = np.log(grid[kept]), moduli[1:][kept]
    if not kept.any():
        logs, weights = np.log(grid[[len(grid) // 2]]), np.ones(1)
    # The storage modulus at each time, as reference of errors.
    order = np.argsort(data.frequency)
    level = np.interp(-logs, np.log(data.frequency[order]), data.storage[order])
    sets = [logs]
    while len(logs) > 1:
        harmonic = weights[:-1] * weights[1:] / (weights[:-1] + weights[1:])
        cost = harmonic / np.minimum(level[:-1], level[1:]) * np.diff(logs) ** 2
        i = int(np.argmin(cost))
        pair = slice(i, i + 2)
        joined = np.average(logs[pair], weights=weights[pair])
        logs, level = (np.delete(each, i) for each in (logs, level))
        weights[i + 1] += weights[i]
        logs[i], weights = joined, np.delete(weights, i)
        sets.append(logs.copy())
    return [np.exp(each) for each in sets[::-1] if len(each) <= most]
