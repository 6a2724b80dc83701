"""Step-size control: how long the next step may be, from the last one's error."""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array

SAFETY = 0.9
SHRINK, GROW = 0.1, 2.0


def step_factor(error: Array | float, order: int) -> Array:
    """Factor on the step that brings `error` (1 = just accepted) to its target.

    safety * error^(-1/order), between `SHRINK` and `GROW`; an error that is not finite shrinks.
    """
    error = np.nan_to_num(np.asarray(error, dtype=float), nan=np.inf, posinf=np.inf)
    with np.errstate(divide="ignore"):
        return np.clip(SAFETY * error ** (-1.0 / order), SHRINK, GROW)
