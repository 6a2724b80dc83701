"""Linear systems of an implicit stage, by PETSc's conjugate gradients.

The preconditioner is the diagonal, on any number of ranks. It takes some twenty iterations
(docs/explanation/ice.md). Options begin with `-heat_`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.fenics.compat import PETSc, solve_linear, take_options
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged

MOST_ITERATIONS = 2000
RELATIVE = 1e-4  # relative residual; the next Newton iteration removes the rest


class LinearSolver:
    """Solves symmetric positive systems of one size."""

    def __init__(self, comm: Any, close: float) -> None:
        """`close`: absolute tolerance of the preconditioned residual, in the solution's unit."""
        self._vectors: tuple[PETSc.Vec, PETSc.Vec] | None = None
        self._ksp = ksp = PETSc.KSP().create(comm)
        ksp.setOptionsPrefix("heat_")
        ksp.setType("cg")
        ksp.setTolerances(rtol=RELATIVE, atol=close, max_it=MOST_ITERATIONS)
        ksp.getPC().setType("jacobi")
        take_options(ksp)

    @property
    def iterations(self) -> int:
        """Iterations for the last system."""
        return int(self._ksp.getIterationNumber())

    def solve(self, matrix: PETSc.Mat, right: Array) -> Array:
        """The solution (n_own,). Raises NotConverged. Collective."""
        if self._vectors is None:
            self._vectors = matrix.createVecs()
        load, solution = self._vectors
        load.array[:] = right
        self._ksp.setOperators(matrix)
        solve_linear(self._ksp, load, solution)
        if self._ksp.getConvergedReason() < 0:
            raise NotConverged("the linear solver of the heat equation fails")
        return np.array(solution.array)


def check_options(comm: Any) -> None:
    """Raise SceneError if PETSc does not know a value of an option `-heat_...`. Collective."""
    LinearSolver(comm, 1.0)
