"""Equilibrium of the block under its plate: the equations, and the factors kept between solves."""

from __future__ import annotations

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody
from iceslide_fem.rubber.loaded_block import LoadedBlock, TractionLaw
from iceslide_fem.rubber.newton import LAG, Newton, Solution
from iceslide_fem.rubber.plate_contact import lift_of
from iceslide_fem.rubber.tangent import Tangent

ROUNDING = 1e-11  # of the plate's force: rounding error of the elastic forces
CONTACT = 0.2  # of the tolerance: residual of the contact part in a change by kept factors


class Equilibrium:
    """Solves for the displacements of `rubber` and the plate.

    Each solve has its plate force (N; N/m in a slice; half in a half model) and traction law.
    Factors of the tangent are kept between solves.
    """

    def __init__(
        self,
        rubber: HyperelasticBody,
        surface: ContactSurface,
        penalty: float,
        prefix: str = "rubber_",
        lag: int | None = None,
    ) -> None:
        """`penalty` in Pa/m; `prefix` selects PETSc options of the linear solver.

        Factors are kept if `lag` more iterations at the last rate reach the tolerance; by default
        `newton.LAG`, 0 for full Newton.
        """
        self.rubber, self.surface, self.penalty = rubber, surface, penalty
        self.tangent = Tangent(rubber, surface, prefix)
        self._residual = rubber.create_vector()
        self._lag = LAG[rubber.mesh.geometry.dim] if lag is None else (lag, 0)
        self._kept = False  # whether there are factors

    def under(
        self, force: float | None, law: TractionLaw, contact_tolerance: float = 0.0
    ) -> LoadedBlock:
        """The equations under a plate `force` downwards, or a held plate with None."""
        settings = self.penalty, self.tangent, self._residual, force, law, contact_tolerance
        return LoadedBlock(self.rubber, self.surface, *settings)

    def solve(self, force: float | None, law: TractionLaw, tolerance: float) -> Solution:
        """Find equilibrium from the present displacements under a downward plate `force`.

        With None the plate is held at its present position. tolerance: norm of the residual, N, at
        least its rounding error. Raises NotConverged; the displacements are then those of the last
        iterate, and the caller restores them.
        """
        tolerance = max(tolerance, ROUNDING * (force or 0.0), self.rubber.force_rounding())
        equations = self.under(force, law, CONTACT * tolerance)
        newton = Newton(equations, tolerance, self._lag, self._kept)
        self._kept = False
        iterations, residual = newton.solve(force)
        self._kept = newton.kept
        return Solution(iterations, newton.jacobians, residual, equations.carried)

    def forget(self) -> None:
        """Drop the kept factors (after the displacements were restored from far away)."""
        self._kept = False

    def lower_plate(self, depth: float) -> None:
        """Move the plate downwards by `depth` (m), and the rubber in proportion to its height."""
        u, rubber = self.rubber.displacements, self.rubber
        z = rubber.space.tabulate_dof_coordinates()[:, u.shape[1] - 1]
        top = rubber.mesh.comm.allreduce(float(z.max(initial=0.0)), op=MPI.MAX)
        u[:, -1] -= depth * z / top
        u[rubber.plate, -1] = -self.plate_displacement()

    def plate_displacement(self) -> float:
        """Downward displacement of the plate, m. Collective."""
        rubber = self.rubber
        return -lift_of(rubber.plate, rubber.displacements, rubber.mesh.comm)
