"""SciPy's conjugate gradients for symmetric matrix-free systems."""

from __future__ import annotations

import inspect
from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from iceslide_fem.runtime.arrays import Array

_TOLERANCE = "rtol" if "rtol" in inspect.signature(cg).parameters else "tol"  # since SciPy 1.12

Function = Callable[[Array], Array]


def conjugate_gradients(
    system: Function, inverse: Function, load: Array, tolerance: float, iterations: int
) -> tuple[Array, bool]:
    """Solve system(x) = load to a relative residual; x (n,), and whether it converges.

    inverse: the preconditioner.
    """
    n = load.size
    operator, near = (LinearOperator((n, n), one, dtype=float) for one in (system, inverse))
    found, fault = cg(
        operator, load, maxiter=iterations, M=near, atol=0.0, **{_TOLERANCE: tolerance}
    )
    return np.asarray(found), not fault
