"""The linear systems of an implicit stage: PETSc's conjugate gradients.

The preconditioner is PETSc's incomplete Cholesky factor of each rank's own block, in the order of
`HeatEquation`: column by column. Steps are short, so that heat hardly goes sideways within one, and
a handful of iterations suffice (docs/heat.md). It is kept as long as it serves. Options begin with
`-heat_`: with `-heat_pc_type hypre`, `gamg` or `cholesky` PETSc takes another.
"""

from __future__ import annotations

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged
from iceslide_fem.fenics.compat import PETSc, solve_linear

# A factor is made anew where it takes so many iterations more than when it was new.
MORE_ITERATIONS = 4
MOST_ITERATIONS = 2000
RELATIVE = 1e-13  # what rounding leaves: the absolute tolerance ends before


class LinearSolver:
    """Solves symmetric positive systems that change little from one to the next."""

    def __init__(self, comm: object, close: float) -> None:
        """Solutions are as `close` (of their unit) as the preconditioned residual tells."""
        self._ksp = ksp = PETSc.KSP().create(comm)
        ksp.setOptionsPrefix("heat_")
        ksp.setType("cg")
        ksp.setTolerances(rtol=RELATIVE, atol=close, max_it=MOST_ITERATIONS)
        ksp.getPC().setType("bjacobi")
        options = PETSc.Options()
        if not options.hasName("heat_sub_pc_type"):
            options["heat_sub_pc_type"] = "icc"
        ksp.setFromOptions()
        self._fresh: int | None = None

    def solve(self, matrix: PETSc.Mat, right: Array) -> Array:
        """The solution (n_own,). Raises NotConverged. Collective."""
        ksp = self._ksp
        load, solution = matrix.createVecs()
        load.array[:] = right
        ksp.setOperators(matrix)
        keep = self._fresh is not None
        ksp.getPC().setReusePreconditioner(keep)
        solve_linear(ksp, load, solution)
        if keep and self._serves_no_more():
            ksp.getPC().setReusePreconditioner(False)
            self._fresh = None
            if ksp.getConvergedReason() < 0:
                ksp.setOperators(matrix)
                solve_linear(ksp, load, solution)
        if ksp.getConvergedReason() < 0:
            self._fresh = None
            raise NotConverged("the linear solver of the heat equation fails")
        if self._fresh is None and not keep:
            self._fresh = ksp.getIterationNumber()
        found = solution.array.copy()
        for vector in (load, solution):
            vector.destroy()
        return found

    def _serves_no_more(self) -> bool:
        assert self._fresh is not None
        ksp = self._ksp
        return bool(
            ksp.getConvergedReason() < 0 or ksp.getIterationNumber() > self._fresh + MORE_ITERATIONS
        )
