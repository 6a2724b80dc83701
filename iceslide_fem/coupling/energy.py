"""The energy ledger: what the plate gives against what film, ice and rubber take."""

from __future__ import annotations

from iceslide_fem.arrays import Array
from iceslide_fem.coupling.sliding import Accepted, Sliding

ENERGIES = (
    "friction_work",
    "load_work",
    "ice_heat",
    "rubber_heat",
    "latent_heat",
    "elastic_energy",
    "kinetic_energy",
)


class Ledger:
    """Energies of the whole block since t = 0, J.

    friction_work: of the plate against friction, F v; load_work: of the plate's weight; ice_heat,
    rubber_heat, latent_heat: what the interface gave; elastic_energy: change of what block and
    penalty store; kinetic_energy: of the block relative to the plate. The
    plate's work should equal the sum of the others.
    """

    def __init__(self, sliding: Sliding) -> None:
        """Start at the present moment of `sliding`. Collective."""
        self._sliding, self._block = sliding, sliding.block
        self.friction_work = self.load_work = 0.0
        self.ice_heat = self.rubber_heat = self.latent_heat = 0.0
        self.elastic_energy = self.kinetic_energy = 0.0
        self._force = self.friction_force()
        self._plate = self._block.equilibrium.plate_displacement()
        self._stored = self._elastic()

    def add(self, accepted: Accepted) -> None:
        """Enter an accepted step (the block's displacements are its). Collective."""
        block, step, area = self._block, accepted.interface_step.step, accepted.interface_step.area
        force, plate = self.friction_force(), block.equilibrium.plate_displacement()
        distance = block.scene.load.speed * accepted.dt
        self.friction_work += 0.5 * (force + self._force) * distance
        self.load_work += block.scale * block.force * (plate - self._plate)
        self.ice_heat += self._integral(step.ice_heat, area)
        self.rubber_heat += self._integral(step.rubber_heat, area)
        self.latent_heat += self._integral(step.latent_heat, area)
        if accepted.solved:
            self.elastic_energy = self._elastic() - self._stored
            motion, law = self._sliding.current.motion, self._sliding.motion_law
            self.kinetic_energy = block.scale * law.kinetic_energy(motion)
        self._force, self._plate = force, plate

    def state(self) -> dict[str, float]:
        """The energies, J."""
        return {name: getattr(self, name) for name in ENERGIES}

    def restore(self, state: dict[str, float]) -> None:
        """Go on from `state`, at the moment to which `sliding` was restored. Collective."""
        for name in ENERGIES:
            setattr(self, name, state[name])
        self._force = self.friction_force()
        self._plate = self._block.equilibrium.plate_displacement()

    @property
    def imbalance(self) -> float:
        """What is missing or too much, relative to the friction work."""
        if self.friction_work == 0.0:
            return 0.0
        given = self.friction_work + self.load_work
        taken = self.ice_heat + self.rubber_heat + self.latent_heat
        kept = self.elastic_energy + self.kinetic_energy
        return (given - taken - kept) / self.friction_work

    def friction_force(self) -> float:
        """Friction force of the whole block at the present current, N. Collective."""
        current = self._sliding.current
        return self._integral(
            self._sliding.shear(current.interface, current.loads), current.loads.area
        )

    def _integral(self, density: Array, area: Array) -> float:
        return self._block.scale * self._block.surface.total(density, area)

    def _elastic(self) -> float:
        block, contact = self._block, self._block.contact
        penalty = 0.5 * contact.pressure**2 / block.equilibrium.penalty
        sunk = block.surface.total(penalty, contact.area)
        return block.scale * (block.rubber.elastic_energy() + sunk)
