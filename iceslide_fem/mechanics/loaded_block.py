"""The equations of the block under its plate's force and the tractions of the ice.

Unknowns are the nodal displacements and the plate's vertical displacement. All nodes on the plate
have the plate's displacement. The last equation prescribes the plate's force or its position.
Results at the present displacements are cached until the next residual.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.mechanics.contact import (
    ContactState,
    Traction,
    contact_forces,
    contact_state,
    contact_tangent,
)
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mechanics.newton import LAG, PATIENT, Newton, Patience, Solution
from iceslide_fem.mechanics.plate_contact import lift_of
from iceslide_fem.mechanics.tangent import Tangent
from iceslide_fem.runtime.arrays import Array

# Tangential traction on the rubber, from contact pressure (f, q) and displacement (f, q, d-1).
TractionLaw = Callable[[Array, Array], Traction]
# Full steps may cycle over the touchdown of at most this many points. The equilibrium is then where
# a point hardly touches and its shear is half faded in. The step ends there, after this fraction of
# the way on which the point touches.
CHATTERING, TOUCH = 3, 0.03


class LoadedBlock:
    """Equations (`newton.Equations`) of `rubber` under a `force` (N) and a traction `law`.

    carried: what the plate carries, N, at the last residual. All methods are collective.
    """

    def __init__(
        self,
        rubber: HyperelasticBody,
        surface: ContactSurface,
        penalty: float,
        tangent: Tangent,
        residual: PETSc.Vec,
        force: float | None,
        law: TractionLaw,
        contact_tolerance: float = 0.0,
    ) -> None:
        """force: None for a held plate; contact_tolerance: residual of the contact in a
        change, N.
        """
        self.rubber, self._surface, self._penalty = rubber, surface, penalty
        self._tangent, self._vector = tangent, residual
        self._force, self._law, self._contact_tolerance = force, law, contact_tolerance
        self.values: Array = rubber.u.x.array
        self.carried = 0.0
        self._plate_residual: float | None = None
        self._contact: ContactState
        self._traction: Traction
        self._linearised: ContactState | None = None  # state of the Jacobian

    @property
    def gap(self) -> Array:
        """Gap of the contact points, m."""
        return self._contact.gap

    @property
    def stale(self) -> bool:
        """Whether a new factorisation would reduce the cost."""
        return self._tangent.stale

    def residual(self) -> float:
        """Norm of internal minus external forces, N."""
        u, vector, surface = self.rubber.displacements, self._vector, self._surface
        self.rubber.internal_forces(vector)
        self._contact = contact_state(surface, u, self._penalty)
        self._traction = self._law(self._contact.pressure, surface.displacements(u)[..., :-1])
        forces = contact_forces(surface, self._contact, self._traction)
        with vector.localForm() as local:
            surface.scatter(-forces, local.array.reshape(u.shape))
        compat.sum_ghosts(vector)
        self.carried = self.rubber.plate_reaction - self._tangent.imbalance(vector)
        self._plate_residual = None if self._force is None else self._force - self.carried
        return self._tangent.size(vector, self._plate_residual)

    def parts(self) -> tuple[Array, float | None]:
        """The last residual: nodal forces of this rank's dofs, and the plate's, N."""
        return self._vector.array.copy(), self._plate_residual

    def linearise(self) -> None:
        """Assemble and factorise the Jacobian at the last residual."""
        self._tangent.factorise(self._contact_tangent())
        self._linearised = self._contact

    def change(self) -> Array:
        """Newton step by kept factors, with the present contact. Raises NotConverged."""
        if self._contact is not self._linearised:
            self._tangent.update_contact(self._contact_tangent())
        return self._tangent.change(self._vector, self._plate_residual, self._contact_tolerance)

    def length(self, change: Array) -> float:
        """Norm of a change over all ranks' dofs, m."""
        return self._tangent.length(change)

    def landings(self, before: Array, gap: Array) -> tuple[float, ...]:
        """Fractions of the last change at which points that it makes touch or lift just touch.

        gap: at its start, m. Empty unless it undoes the change that started at the gap `before`.
        """
        touches = self._contact.gap < 0.0
        chattering = (gap < 0.0) != touches
        old, new = gap[chattering], self._contact.gap[chattering]
        crossing = old / (old - new)
        lands = np.where(new < 0.0, crossing + TOUCH * (1.0 - crossing), crossing * (1.0 - TOUCH))
        undone = bool(((before < 0.0) == touches).all())
        everywhere = self._surface.comm.allgather((undone, lands))
        fractions = np.sort(np.concatenate([one for _, one in everywhere]))
        few = fractions.size <= CHATTERING and all(whole for whole, _ in everywhere)
        return tuple(fractions) if few else ()

    def _contact_tangent(self) -> Array:
        """Derivatives of the contact forces at the last residual."""
        u = self.rubber.displacements
        return contact_tangent(self._surface, u, self._penalty, self._contact, self._traction)


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

    def solve(
        self, force: float | None, law: TractionLaw, tolerance: float, patience: Patience = PATIENT
    ) -> Solution:
        """Find equilibrium from the present displacements under a downward plate `force`.

        With None the plate is held at its present position. tolerance: norm of the residual, N, at
        least its rounding error. Raises NotConverged; the displacements are then those of the last
        iterate, and the caller restores them.
        """
        tolerance = max(tolerance, ROUNDING * (force or 0.0), self.rubber.force_rounding())
        equations = self.under(force, law, CONTACT * tolerance)
        newton = Newton(equations, tolerance, self._lag, self._kept, patience)
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
