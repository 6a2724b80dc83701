"""What solves for the block's equilibrium: the program's Newton's method, and PETSc's SNES.

Slices, whole slides at one tolerance: steps, iterations, Jacobians, rejected steps and seconds of
the processor, and how far mu(t) is from that of the program's method. SNES has the same equations
and the same factors, by its line searches `nleqerr` (Deuflhard's error-oriented one) and `bt`, with
a Jacobian that lags so many iterations, within a solve and from one to the next. A method that
cannot go on says where. --quick slides for a moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.mechanics.block import build_block
from iceslide_fem.mechanics.loaded_block import CONTACT, Equilibrium, LoadedBlock, TractionLaw
from iceslide_fem.mechanics.newton import MAX_ITERATIONS, PATIENT, Patience, Solution
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene import Scene
from scripts.studies.blocks import Slide, slid
from scripts.studies.common import case, options, table

CASES = ("thesis_1bar", "thesis_5bar")
METHODS: dict[str, dict[str, Any] | None] = {
    "Newton, lagged": None,
    "Newton, full": {"lag": 0},
    "SNES nleqerr, full": {"line_search": "nleqerr", "jacobian": 1},
    "SNES nleqerr, lag 3": {"line_search": "nleqerr", "jacobian": 3},
    "SNES bt, full": {"line_search": "bt", "jacobian": 1},
    "SNES bt, lag 3": {"line_search": "bt", "jacobian": 3},
}
HEAD = ("case", "method", "steps", "rejected", "iterations", "Jacobians", "s", "largest of mu(t)",
        "of mean mu")  # fmt: skip


class Counted(Equilibrium):
    """The program's method, with its Jacobians counted."""

    jacobians = 0

    def solve(
        self, force: float | None, law: TractionLaw, tolerance: float, patience: Patience = PATIENT
    ) -> Solution:
        """As `Equilibrium.solve`."""
        solution = super().solve(force, law, tolerance, patience)
        self.jacobians += solution.jacobians
        return solution


class BySnes(Counted):
    """PETSc's SNES for the same equations."""

    def __init__(self, *settings: Any, line_search: str, jacobian: int) -> None:
        super().__init__(*settings)
        n = self.rubber.u.x.array.size
        self._equations: LoadedBlock
        self._size, self._tolerance, self._made = np.inf, 0.0, 0
        residual = PETSc.Vec().createSeq(n)
        matrix = PETSc.Mat().createAIJ((n, n), nnz=1, comm=MPI.COMM_SELF)  # only its size is used
        matrix.assemble()
        snes = self._snes = PETSc.SNES().create(MPI.COMM_SELF)
        snes.setType("newtonls")
        snes.setFunction(self._evaluate, residual)
        snes.setJacobian(self._linearise, matrix)
        snes.setConvergenceTest(self._converged)
        snes.setTolerances(max_it=MAX_ITERATIONS)
        ksp = snes.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(self)
        with_prefix = PETSc.Options()
        with_prefix["compared_snes_linesearch_type"] = line_search
        with_prefix["compared_snes_lag_jacobian"] = jacobian
        with_prefix["compared_snes_lag_jacobian_persists"] = True
        snes.setOptionsPrefix("compared_")
        snes.setFromOptions()

    def solve(
        self, force: float | None, law: TractionLaw, tolerance: float, patience: Patience = PATIENT
    ) -> Solution:
        """As `Equilibrium.solve`, by SNES, whatever the patience."""
        self._tolerance = max(tolerance, self.rubber.force_rounding())
        self._equations = self.under(force, law, CONTACT * self._tolerance)
        self._size, before = self._equations.residual(), self._made
        x = PETSc.Vec().createWithArray(self._equations.values.copy(), comm=MPI.COMM_SELF)
        self._snes.solve(None, x)
        self.jacobians += self._made - before
        if self._snes.getConvergedReason() <= 0:
            raise NotConverged(f"SNES ends with reason {self._snes.getConvergedReason()}")
        self._equations.values[:] = x.array
        size = self._equations.residual()
        iterations = self._snes.getIterationNumber()
        return Solution(iterations, self._made - before, size, self._equations.carried)

    def _evaluate(self, snes: Any, x: Any, residual: Any) -> None:
        self._equations.values[:] = x.array
        self._size = self._equations.residual()
        forces, plate = self._equations.parts()
        inverted = not np.isfinite(self._size)  # SNES ends where its norm is no number
        residual.array[:] = np.inf if inverted else forces
        residual.array[0] += plate or 0.0

    def _linearise(self, snes: Any, x: Any, matrix: Any, same: Any) -> None:
        self._made += 1
        self._equations.linearise()
        matrix.assemble()

    def _converged(self, *given: Any) -> Any:
        fine = self._size <= self._tolerance
        return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_ABS if fine else False

    def apply(self, pc: Any, right: Any, solution: Any) -> None:
        """The change by the factors that there are, of the present residual."""
        solution.array[:] = -self._equations.change()


def slid_by(scene: Scene, method: dict[str, Any] | None) -> tuple[Slide, int]:
    """A slide, and the Jacobians that it took. Raises SimulationStopped."""
    block = build_block(scene, MPI.COMM_SELF)
    settings = block.rubber, block.surface, block.equilibrium.penalty
    kind = BySnes if method and "line_search" in method else Counted
    solver = kind(*settings, **(method or {}))
    return slid(scene, replace(block, equilibrium=solver)), solver.jacobians


def rows(quick: bool) -> Iterator[tuple[object, ...]]:
    """Of every case by every method."""
    for name in CASES[:1] if quick else CASES:
        changes = ["load.duration=0.5ms"] if quick else []
        scene = case(name, "model=slice", "numerics.tolerance=1e-2", *changes)
        exact: Slide | None = None
        for method, settings in METHODS.items():
            try:
                run, jacobians = slid_by(scene, settings)
            except SimulationStopped as stopped:
                yield (name, method, *["-"] * 5, str(stopped)[:70], "-")
                continue
            exact = exact or run
            off = np.abs(np.interp(exact.time, run.time, run.mu) - exact.mu).max() / exact.mean
            yield (
                name, method, run.steps, run.rejected, run.iterations, jacobians,
                f"{run.seconds:.1f}", f"{off:.1e}", f"{run.mean / exact.mean - 1.0:+.1e}",
            )  # fmt: skip


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment of one case")
    table(HEAD, rows(parser.parse_args().quick))


if __name__ == "__main__":
    main()
