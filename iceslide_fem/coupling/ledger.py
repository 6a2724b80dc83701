"""The ledger: what the plate gives against what film, ice and rubber take; and the water."""

from __future__ import annotations

from iceslide_fem.coupling.energy import Energies
from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep

WATER = ("squeezed_water", "lost_water")


class Ledger:
    """Energies of the whole block since t = 0, J: attributes named as those of `Energies`.

    squeezed_water: what the contact has squeezed out; lost_water: what of it is neither below the
    rubber nor on the ice of the window; m3.
    """

    def __init__(self, sliding: Sliding) -> None:
        """Start at the present moment of `sliding`."""
        self._sliding = sliding
        self.begin()

    def begin(self) -> None:
        """Count from the present moment on."""
        self.friction_work = self.load_work = 0.0
        self.ice_heat = self.rubber_heat = self.latent_heat = self.wall_heat = 0.0
        self.rubber_dissipation = 0.0
        self.elastic_energy = self.kinetic_energy = 0.0
        self.squeezed_water = self.lost_water = 0.0

    def add(self, accepted: AcceptedStep) -> None:
        """Enter an accepted step."""
        for name, energy in accepted.energies._asdict().items():
            setattr(self, name, getattr(self, name) + energy)
        self.squeezed_water += accepted.squeezed_water
        self.lost_water += accepted.lost_water

    def state(self) -> dict[str, float]:
        """The energies, J, and the water, m3."""
        return {name: getattr(self, name) for name in (*Energies._fields, *WATER)}

    def restore(self, state: dict[str, float]) -> None:
        """Go on from `state`, at the moment to which `sliding` was restored."""
        for name in (*Energies._fields, *WATER):
            setattr(self, name, state[name])

    @property
    def imbalance(self) -> float:
        """What is missing or too much, relative to the friction work."""
        if self.friction_work == 0.0:
            return 0.0
        energies = Energies(*(getattr(self, name) for name in Energies._fields))
        return energies.missing / self.friction_work

    def friction_force(self) -> float:
        """Friction force of the whole block at the present moment, N."""
        return self._sliding.current.mechanics.friction_force
