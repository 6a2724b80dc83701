"""The ledger: energy balance and water balance of a run."""

from __future__ import annotations

from iceslide_fem.coupling.energy import Energies
from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep, WaterFlows

ENTRIES = (*Energies._fields, *WaterFlows._fields)


class Ledger:
    """Energies of the whole block since t = 0, J: attributes named as in `Energies`. Water, m3, as
    in `WaterFlows`; brought_water includes the water on the ice at t = 0.
    """

    def __init__(self, sliding: Sliding) -> None:
        """Start at the present time of `sliding`."""
        self._sliding = sliding
        self.begin()

    def begin(self) -> None:
        """Set all entries to zero at the present time."""
        self.friction_work = self.load_work = 0.0
        self.ice_heat = self.rubber_heat = self.latent_heat = self.wall_heat = 0.0
        self.hysteresis_heat = 0.0
        self.rubber_dissipation = 0.0
        self.elastic_energy = self.kinetic_energy = 0.0
        self.squeezed_water = self.lost_water = self.pushed_out_water = 0.0
        self.brought_water = sum(self.lying_water())

    def add(self, accepted: AcceptedStep) -> None:
        """Add the energies and water of an accepted step."""
        for name, energy in accepted.energies._asdict().items():
            setattr(self, name, getattr(self, name) + energy)
        for name, water in accepted.water._asdict().items():
            setattr(self, name, getattr(self, name) + water)

    def state(self) -> dict[str, float]:
        """The energies, J, and the water, m3."""
        return {name: getattr(self, name) for name in ENTRIES}

    def restore(self, state: dict[str, float]) -> None:
        """Continue from a saved `state`, at the time to which `sliding` was restored."""
        for name in ENTRIES:
            setattr(self, name, state[name])

    def lying_water(self) -> tuple[float, float]:
        """Squeezed-out water below the rubber, and beside it in the ice window, m3. Collective."""
        now, block = self._sliding.current, self._sliding.block
        below, beside = self._sliding.frame.water_areas(now.loads)
        height = now.interface.squeezed_height
        return block.total(height, below), block.total(height, beside)

    def sipe_water(self) -> float:
        """Water in the sipes, m3."""
        return self._sliding.block.scale * float(self._sliding.current.stored.sum())

    @property
    def imbalance(self) -> float:
        """Error of the energy balance, relative to the friction work."""
        if self.friction_work == 0.0:
            return 0.0
        energies = Energies(*(getattr(self, name) for name in Energies._fields))
        return energies.missing / self.friction_work

    def friction_force(self) -> float:
        """Present friction force of the whole block, N."""
        return self._sliding.current.mechanics.friction_force
