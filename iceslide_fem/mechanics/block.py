"""The rubber block on the ice, and its equilibrium under friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.laws.protocol import InterfaceLaw, Sheared
from iceslide_fem.laws.table import law_of
from iceslide_fem.mechanics.contact import (
    ContactState,
    Traction,
    contact_points,
    contact_state,
    default_penalty,
    sliding_friction,
    static_friction,
)
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.mechanics.element import Energy, stored_energy
from iceslide_fem.mechanics.failure import Posture, Slenderness, limit_met, most_slender, posture
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mechanics.loaded_block import Equilibrium, TractionLaw
from iceslide_fem.mechanics.materials import Material
from iceslide_fem.mechanics.newton import PATIENT, Patience, Solution
from iceslide_fem.mechanics.self_contact_friction import StickPoints
from iceslide_fem.mesh.rubber import nominal_area, rubber_mesh
from iceslide_fem.mesh.size import check_memory
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.runtime.ranks import from_root
from iceslide_fem.scene import Scene
from iceslide_fem.scene.tables import too_short, too_soft

# Newton's residual tolerance: the scene's tolerance times these fractions of the plate's force and
# of the friction force. It changes mu(t) by a hundredth of the tolerance. The second is the smaller
# one if mu is below 0.1. With inertia a residual accelerates the rubber, so both are reduced to a
# fifth. Under a law that is not viscous the block is solved for small changes of friction, and the
# residual must be smaller than these: both are reduced to a tenth.
EQUILIBRIUM_SHARE, FRICTION_SHARE, INERTIA, NOT_VISCOUS = 5e-3, 5e-2, 0.2, 0.1
# After points have stuck, the residual would move the block by at most this fraction of its slip in
# the step. Otherwise the slip speed of points that break loose is noise in short steps, and their
# heat does not close the energy balance.
SLIP_SHARE = 1e-3
# Slip at which static friction is fully mobilised, over the height.
STICK_SHARE = 1e-3
# Function of the displacement along x (f, q): slip speed (m/s), and its derivative (1/s).
SpeedLaw = Callable[[Array], tuple[Array, float]]


@dataclass(eq=False)
class Block:
    """A scene's block, its contact surface and its equilibrium solver.

    Present displacements and stick points are those of the last solve. A caller that rejects a
    solve restores them.
    area: nominal contact area of the mesh (m2; m in a slice); force: the plate's (N; N/m) at t = 0;
    scale: force of the whole block over force of the mesh; height: of the block, m.
    """

    scene: Scene
    rubber: HyperelasticBody
    surface: ContactSurface
    equilibrium: Equilibrium
    law: InterfaceLaw
    area: float
    force: float
    scale: float
    height: float

    @property
    def contact(self) -> ContactState:
        """Contact at the present displacements."""
        return contact_state(self.surface, self.rubber.displacements, self.equilibrium.penalty)

    def balance(
        self,
        law: TractionLaw,
        load: float = 1.0,
        friction: float = np.inf,
        slip: float = np.inf,
        patience: Patience = PATIENT,
    ) -> Solution:
        """Find equilibrium under `load` times the plate's force. Raises NotConverged.

        friction: friction force of the law, N, of the mesh. The residual is also small relative to
        it, unless it is 0. slip: distance (m) relative to which the block's shear has to be exact.
        """
        force = self.force * load
        scale = EQUILIBRIUM_SHARE * force
        if friction > 0.0:
            scale = min(scale, FRICTION_SHARE * friction)
        stiffness = self.scene.softest.shear_modulus * self.area / self.height
        residual = min(self._tolerance * scale, SLIP_SHARE * stiffness * slip)
        return self.equilibrium.solve(force, law, residual, patience)

    def balance_under_held_plate(self, law: TractionLaw) -> Solution:
        """Find equilibrium with the plate held at its present position. Raises NotConverged."""
        tolerance = self._tolerance * EQUILIBRIUM_SHARE * self.force
        return self.equilibrium.solve(None, law, tolerance)

    @property
    def _tolerance(self) -> float:
        inertia = INERTIA if self.scene.rubber.inertia else 1.0
        law = 1.0 if self.law.viscous else NOT_VISCOUS
        return self.scene.numerics.tolerance * min(inertia, law)

    def drag(self, law: TractionLaw) -> float:
        """Force of `law` against the sliding direction, N, of the whole block. Collective."""
        contact, moved = self.contact, self.surface.displacements(self.rubber.displacements)
        traction = law(contact.pressure, moved[..., :-1]).value[..., 0]
        return -self.total(traction, contact.area)

    def friction_force(self, sheared: Sheared) -> float:
        """Friction force (N, of the mesh) at the mean speed. Collective."""
        contact = self.contact
        speed = np.full_like(contact.pressure, self.scene.load.speeds.mean)
        return self.surface.total(sheared(contact.pressure, speed)[0], contact.area)

    def static(self, pressure: Array, displacement: Array) -> Traction:
        """Static friction of the press phase."""
        coefficient = self.scene.load.static_friction
        return static_friction(pressure, displacement, coefficient, STICK_SHARE * self.height)

    def sliding(self, sheared: Sheared, speed: SpeedLaw) -> TractionLaw:
        """Traction law of the shear; the slip speed may depend on the rubber's motion."""

        def law(pressure: Array, displacement: Array) -> Traction:
            slip, slope = speed(displacement[..., 0])
            return _slipping(*sheared(pressure, slip), slope, displacement.shape[-1])

        return law

    def held(self, sheared: Sheared, speed: SpeedLaw, pressure: Array) -> TractionLaw:
        """The same with constant pressures (f, q), Pa, instead of the present ones."""

        def law(_: Array, displacement: Array) -> Traction:
            slip, slope = speed(displacement[..., 0])
            shear, by_pressure, by_speed = sheared(pressure, slip)
            still = np.zeros_like(by_pressure)
            return _slipping(shear, still, by_speed, slope, displacement.shape[-1])

        return law

    def stop_at_faults(self, moment: str) -> None:
        """Raise SimulationStopped on all ranks if the friction law has a fault. Collective."""
        faults = self.surface.comm.allgather(self.law.fault)
        found = [(rank, fault) for rank, fault in enumerate(faults) if fault]
        if found:
            rank, fault = found[0]
            where = f" (on rank {rank} of {len(faults)})" if len(faults) > 1 else ""
            raise SimulationStopped(f"{fault}{where}; the run stops at {moment}")

    def limit_met(self) -> str:
        """The mechanical limit met at the present displacements, in words. Collective."""
        return limit_met(self.posture(), self.slenderness)

    def posture(self) -> Posture:
        """Posture of the block at the present displacements. Collective."""
        displacements, penalty = self.rubber.displacements, self.equilibrium.penalty
        return posture(self.surface, displacements, penalty, self.slenderness)

    @cached_property
    def slenderness(self) -> Slenderness:
        """The block or a lug between its sipes, whichever is more slender. Collective."""
        return most_slender(self.rubber.mesh, self.height, self.scene.rubber)

    def smallest_opening(self, below: float = np.inf) -> float:
        """Smallest distance of facing walls of sipes and grooves, m. Collective.

        Negative for penetration, infinite without walls. Of open walls it is infinite if it is not
        `below` that.
        """
        walls = self.rubber.self_contact
        return np.inf if walls is None else walls.smallest_opening(self.rubber.displacements, below)

    @property
    def stick_points(self) -> StickPoints | None:
        """Stick points of the last accepted equilibrium; None without friction of walls."""
        walls = self.rubber.self_contact
        return None if walls is None else walls.stick_points

    def set_stick_points(self, stick_points: StickPoints | None) -> None:
        """Set the friction history of the self-contact: that of an accepted equilibrium."""
        if self.rubber.self_contact is not None:
            self.rubber.self_contact.stick_points = stick_points

    def stick_points_after(self) -> tuple[StickPoints | None, float]:
        """Stick points at the present displacements, and the frictional heat of walls. Collective.

        The heat is that of the whole block since the last accepted equilibrium, J.
        """
        walls = self.rubber.self_contact
        if walls is None or walls.stick_points is None:
            return None, 0.0
        stick_points, heat = walls.followed(self.rubber.displacements)
        return stick_points, self.scale * heat

    def normal_force(self, contact: ContactState) -> float:
        """Contact force of the whole block, N. Collective."""
        return self.total(contact.pressure, contact.area)

    def total(self, density: Array, area: Array) -> float:
        """Integral of `density` over the contact of the whole block. Collective.

        area: of the points, m2 (m in a slice), of the same shape.
        """
        return self.scale * self.surface.total(density, area)


def _slipping(
    shear: Array, by_pressure: Array, by_speed: Array, slope: float, components: int
) -> Traction:
    """Traction of a shear (Pa), with its derivatives.

    slope: derivative of the slip speed with displacement, 1/s.
    """
    traction = sliding_friction(shear, by_pressure, components)
    traction.by_displacement[..., 0, 0] = -by_speed * slope
    return traction


# Penalty of self-contact over that of the ice contact. Lugs are soft: with stiffer walls the
# iteration would open and close them alternately.
WALLS = 0.1


def build_block(scene: Scene, comm: MPI.Comm, energy: Energy = stored_energy) -> Block:
    """Mesh the scene's block and prepare its forms. Collective.

    energy: another element than the default. Raises SceneError if the user's mesh or the penalty is
    unsuitable, or if the memory does not suffice.
    """
    law = law_of(scene)
    from_root(lambda: check_memory(scene), comm)
    mesh = rubber_mesh(scene, comm)
    z = mesh.mesh.geometry.x[:, mesh.mesh.geometry.dim - 1]
    height = float(comm.allreduce(z.max(initial=0.0), op=MPI.MAX))
    x = mesh.mesh.geometry.x[:, 0]
    ends = np.array([x.max(initial=-np.inf), -x.min(initial=np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    # a user's mesh has its height and its length only now
    fault = too_soft(scene, height) or too_short(scene, float(ends.sum()))
    if fault is not None:
        raise SceneError(fault)
    inertia = float(scene.rubber.inertia)
    materials = {
        name: Material(one.constants(), one.relaxation, inertia * one.density)
        for name, one in scene.rubber.compounds.items()
    }
    rubber = HyperelasticBody(mesh, materials, 2, energy)
    numerics = scene.numerics
    penalty = numerics.penalty or default_penalty(scene.mooney_rivlin, height, numerics.tolerance)
    rubber.enable_self_contact(WALLS * penalty, scene.rubber.wall_friction)
    rubber.enable_plate_contact(height, penalty)
    surface = contact_points(scene, rubber, height)
    ds = ufl.Measure("ds", domain=mesh.mesh, subdomain_data=mesh.facet_tags)
    plate = fem.Constant(mesh.mesh, PETSc.ScalarType(1.0)) * ds(mesh.tags["plate"])
    area = nominal_area(scene) or compat.assemble_scalar(compat.form(plate), comm)
    if scene.model == "slice":
        scale = scene.rubber.width
    else:
        scale = 2.0 if "symmetry" in mesh.tags else 1.0
    pressure = scene.load.pressures.first
    return Block(
        scene,
        rubber,
        surface,
        Equilibrium(rubber, surface, penalty),
        law,
        area,
        pressure * area,
        scale,
        height,
    )
