"""Joint samples of uncertain inputs, alone or from a calibration."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular
from iceslide_fem.scene.distribution import CUT, Distribution
from iceslide_fem.scene.variation import parameter


class Calibrated(NamedTuple):
    """Parameters from a calibration: keys, means and covariance of their ln, bounds of ln."""

    keys: tuple[str, ...]
    centre: Array
    root: Array
    low: Array
    high: Array

    def at(self, quantile: Array) -> Array:
        """Values at quantiles (n, p) of independent normal factors, cut at `CUT`; (n, p)."""
        ends = norm.cdf([-CUT, CUT])
        drawn = norm.ppf(ends[0] + quantile * (ends[1] - ends[0]))
        return np.exp(np.clip(self.centre + drawn @ self.root.T, self.low, self.high))


class Inputs(NamedTuple):
    """All uncertain inputs: distributions of single keys, and parameters of a calibration."""

    single: Sequence[Distribution]
    calibrated: Calibrated | None = None

    @property
    def keys(self) -> list[str]:
        """Keys in the order of the values."""
        joint = () if self.calibrated is None else self.calibrated.keys
        return [*(one.parameter.key for one in self.single), *joint]

    @property
    def groups(self) -> dict[str, list[int]]:
        """Columns that vary as one, by name: parameters of a calibration depend on each other."""
        single = {one.parameter.key: [i] for i, one in enumerate(self.single)}
        joint = list(range(len(single), len(self.keys)))
        return single | ({"calibration": joint} if joint else {})

    def at(self, quantile: Array) -> Array:
        """Values (n, keys) in SI at independent quantiles (n, keys)."""
        count = len(self.single)
        columns = [one.at(quantile[:, i]) for i, one in enumerate(self.single)]
        if self.calibrated is not None:
            columns += list(self.calibrated.at(quantile[:, count:]).T)
        return np.column_stack(columns)


def read_calibration(path: Path) -> Calibrated:
    """The parameters of a calibration.json, or of its folder. Raises SceneError."""
    file = path / "calibration.json" if path.is_dir() else path
    check_regular(file, "the calibration")
    try:
        found = json.loads(file.read_bytes())
        parts = found["parameters"]
        centre = np.log([float(one["estimate"]) for one in parts.values()])
        low, high = np.log([[float(end) for end in one["bounds"]] for one in parts.values()]).T
        covariance = np.array(found["covariance_of_ln"], dtype=float)
        if covariance.shape != 2 * centre.shape:
            raise ValueError
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        raise SceneError(f"{file} is no calibration.json of iceslide calibrate") from None
    for key in parts:
        parameter(key)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return Calibrated(tuple(parts), centre, root, low, high)
