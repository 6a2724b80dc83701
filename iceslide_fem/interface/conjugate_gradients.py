"""Conjugate gradients for the temperatures of the ice's surface within a stage."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from iceslide_fem.arrays import Array


def conjugate_gradients(
    load: Callable[[Array], Array],
    answered: Callable[[Array], Array],
    wanted: Array,
    close: Callable[[Array, float], bool],
    iterations: int,
) -> tuple[Array, Array, bool]:
    """x with load(x) = `wanted`, preconditioned: x, what is left of it, and whether it is `close`.

    load, answered: symmetric and linear, of the shape of `wanted`. `answered` may be blind to
    some of it: there x stays zero, and something is left. close: of the answer to what is left and
    the product of both, as a share of the first. At most so many `iterations`.
    """
    x, left = np.zeros_like(wanted), wanted
    direction = answer = answered(left)
    size = first = float(np.vdot(left, answer))
    for _ in range(iterations):
        if close(answer, size / first if first else 0.0):
            return x, left, True
        against = load(direction)
        length = size / float(np.vdot(direction, against))
        x = x + length * direction
        left = left - length * against
        answer = answered(left)
        size, before = float(np.vdot(left, answer)), size
        direction = answer + size / before * direction
    return x, left, False
