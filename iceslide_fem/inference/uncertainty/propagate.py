"""The spread of mu: of points by sampling, of slices and blocks by points as control variate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from iceslide_fem.inference.uncertainty.sampling import Inputs
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene
from iceslide_fem.scene.variation import with_values

SEED = 9
MANY = 10_000  # points that are pushed through a control variate
FOR_INDICES = 256  # samples of each of the sets that indices take
LARGEST_PART = 0.05  # of samples that may fail


class Samples(NamedTuple):
    """Inputs (n, keys), SI, and mu (n,), NaN where the computation failed; reasons by sample."""

    values: Array
    mu: Array
    reasons: dict[int, str]


class Runs(NamedTuple):
    """Slices or blocks at some inputs (n, keys): their mu and that of points there, (n,).

    mu = offset + slope * point, with a rest of standard deviation `rest`; correlation: of both.
    """

    values: Array
    mu: Array
    points: Array
    offset: float
    slope: float
    rest: float
    correlation: float


class Spread(NamedTuple):
    """The spread of mu: samples, Sobol indices by group (first order, total), and runs or None."""

    samples: Samples
    indices: dict[str, tuple[float, float]]
    runs: Runs | None
    mu: Array


def spread_of_points(scene: Scene, inputs: Inputs, count: int, output: str) -> Spread:
    """The spread of mu of a point `scene` from `count` samples (a power of 2).

    Raises SimulationStopped if more than `LARGEST_PART` of them fail.
    """
    samples = _computed(scene, inputs, _sobol(len(inputs.keys), count), output)
    return Spread(samples, _indices(scene, inputs, output), None, samples.mu)


def spread_of_runs(
    scene: Scene,
    inputs: Inputs,
    number: int,
    output: str,
    run: Callable[[Sequence[Scene], Path], Array],
    folder: Path,
) -> Spread:
    """The spread of mu of a slice or block from a `number` of runs and many points.

    Runs at a Latin hypercube of the inputs are regressed on points at the same inputs; points at
    many inputs then have the friction that the line gives them, and a rest as large as theirs.
    run: mu of scenes, NaN where one fails. Raises SimulationStopped.
    """
    point = scene.model_copy(update={"model": "point"})
    places = qmc.LatinHypercube(len(inputs.keys), seed=SEED).random(number)
    values = inputs.at(places)
    scenes = [with_values(scene, dict(zip(inputs.keys, row, strict=True))) for row in values]
    mu = run(scenes, folder)
    near = _computed(point, inputs, places, output).mu
    there = np.isfinite(mu) & np.isfinite(near)
    if there.sum() < 3 or (~there).mean() > LARGEST_PART and (~there).sum() > 1:
        raise SimulationStopped(f"{int((~there).sum())} of {number} runs failed; see {folder}")
    slope, offset = np.polyfit(near[there], mu[there], 1)
    off = mu[there] - offset - slope * near[there]
    rest = float(np.sqrt((off**2).sum() / (there.sum() - 2)))
    correlation = float(np.corrcoef(near[there], mu[there])[0, 1])
    samples = _computed(point, inputs, _sobol(len(inputs.keys), MANY), output)
    more = rest * np.random.default_rng(SEED).standard_normal(samples.mu.size)
    runs = Runs(values, mu, near, float(offset), float(slope), rest, correlation)
    return Spread(samples, _indices(point, inputs, output), runs,
                  offset + slope * samples.mu + more)  # fmt: skip


def _sobol(dimensions: int, count: int) -> Array:
    """Scrambled Sobol points, (count, dimensions); of a power of 2 the first `count`."""
    exponent = int(np.ceil(np.log2(count)))
    return qmc.Sobol(dimensions, seed=SEED).random_base2(exponent)[:count]


def _computed(scene: Scene, inputs: Inputs, quantiles: Array, output: str) -> Samples:
    """mu of points at quantiles (n, keys) of the inputs. Raises SimulationStopped."""
    values, keys = inputs.at(quantiles), inputs.keys
    found = friction([with_values(scene, dict(zip(keys, row, strict=True))) for row in values])
    reasons = {number: why for (number, _), why in found.failures.items()}
    if len(reasons) > LARGEST_PART * len(values):
        number, why = next(iter(reasons.items()))
        said = ", ".join(f"{key} = {v:g}" for key, v in zip(keys, values[number], strict=True))
        raise SimulationStopped(
            f"{len(reasons)} of {len(values)} samples failed, more than {LARGEST_PART:.0%}; the "
            f"first one ({said}): {why}"
        )
    return Samples(values, getattr(found, output)[:, 0], reasons)


def _indices(scene: Scene, inputs: Inputs, output: str) -> dict[str, tuple[float, float]]:
    """Sobol indices of each group: first order (Saltelli 2010, eq. b) and total (Jansen 1999).

    The inputs of a group vary together. Failed samples are left out.
    """
    groups, dimensions = inputs.groups, len(inputs.keys)
    both = _sobol(2 * dimensions, FOR_INDICES)
    first, second = both[:, :dimensions], both[:, dimensions:]
    sets = [first, second]
    for columns in groups.values():
        mixed = first.copy()
        mixed[:, columns] = second[:, columns]
        sets.append(mixed)
    mu = _computed(scene, inputs, np.concatenate(sets), output).mu.reshape(len(sets), -1)
    mu = mu[:, np.isfinite(mu).all(axis=0)]
    a, b, *mixed_mu = mu
    variance = float(np.var(np.concatenate([a, b])))
    if variance == 0.0:
        return dict.fromkeys(groups, (0.0, 0.0))
    return {
        name: (
            float(np.mean(b * (one - a)) / variance),
            float(np.mean((a - one) ** 2) / (2.0 * variance)),
        )
        for name, one in zip(groups, mixed_mu, strict=True)
    }
