"""Rows of the histories: what a block and its interface amount to at a moment."""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem._dolfinx import MPI
from iceslide_fem.block import Block, PathPoint
from iceslide_fem.contact import ContactState
from iceslide_fem.materials import MELTING_TEMPERATURE, Array
from iceslide_fem.sliding import Accepted, Moment, Sliding

Row = dict[str, Any]
ENERGIES = (
    "friction_work",
    "load_work",
    "ice_heat",
    "rubber_heat",
    "latent_heat",
    "elastic_energy",
    "kinetic_energy",
)


def preload_row(block: Block, point: PathPoint) -> Row:
    """Row of `preload.csv` for an equilibrium on the way to sliding. Collective."""
    contact = block.contact
    displacement = block.surface.displacements(block.rubber.displacements)[..., :-1]
    traction = point.law(contact.pressure, displacement).value[..., 0]
    highest = float(contact.pressure.max(initial=0.0))
    return {
        "phase": point.phase,
        "load_fraction": point.load,
        "speed_fraction": point.speed,
        "normal_force_N": block.normal_force(contact),
        "friction_force_N": -block.scale * block.surface.total(traction, contact.area),
        "plate_displacement_m": block.equilibrium.plate_displacement(),
        "contact_fraction": _contact_area(block, contact) / block.area,
        "largest_pressure_Pa": block.surface.comm.allreduce(highest, op=MPI.MAX),
        "newton_iterations": point.solution.iterations,
    }


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
        block, step, area = self._block, accepted.passage.step, accepted.passage.area
        force, plate = self.friction_force(), block.equilibrium.plate_displacement()
        distance = block.scene.load.speed * accepted.dt
        self.friction_work += 0.5 * (force + self._force) * distance
        self.load_work += block.scale * block.force * (plate - self._plate)
        self.ice_heat += self._integral(step.ice_heat, area)
        self.rubber_heat += self._integral(step.rubber_heat, area)
        self.latent_heat += self._integral(step.latent_heat, area)
        if accepted.solved:
            self.elastic_energy = self._elastic() - self._stored
            motion, law = self._sliding.moment.motion, self._sliding.motion_law
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
        """Friction force of the whole block at the present moment, N. Collective."""
        moment = self._sliding.moment
        return self._integral(self._sliding.shear(moment.interface, moment.side), moment.side.area)

    def _integral(self, density: Array, area: Array) -> float:
        return self._block.scale * self._block.surface.total(density, area)

    def _elastic(self) -> float:
        block, contact = self._block, self._block.contact
        penalty = 0.5 * contact.pressure**2 / block.equilibrium.penalty
        sunk = block.surface.total(penalty, contact.area)
        return block.scale * (block.rubber.elastic_energy() + sunk)


def slide_row(sliding: Sliding, ledger: Ledger, accepted: Accepted | None) -> Row:
    """Row of `history.csv` at the present moment; `accepted` led to it, None at t = 0. Collective.

    Heights, temperature and the melted and saturated fractions are means over the contact area.
    """
    block, moment = sliding.block, sliding.moment
    contact = moment.contact
    area = np.where(contact.pressure > 0.0, contact.area, 0.0)
    touching = max(_contact_area(block, contact), 1e-300)

    def mean(values: Any) -> float:
        return block.surface.total(values.reshape(area.shape), area) / touching

    carrier = sliding.carrier
    melted, saturated = _switches(sliding, accepted)
    normal, friction = block.normal_force(contact), ledger.friction_force()
    return {
        "time_s": moment.time,
        "step_s": accepted.dt if accepted else 0.0,
        "slip_m": block.scene.load.speed * moment.time,
        "mu": friction / normal,
        "film_height_m": mean(carrier.film_height(moment.interface, moment.side)),
        "squeezed_height_m": mean(carrier.at_points(moment.interface.squeezed_height, moment.side)),
        "surface_temperature_C": mean(_surface(sliding, moment)) - MELTING_TEMPERATURE,
        "contact_fraction": touching / block.area,
        "normal_force_N": normal,
        "friction_force_N": friction,
        "plate_displacement_m": block.equilibrium.plate_displacement(),
        "melted_fraction": mean(melted),
        "saturated_fraction": mean(saturated),
        "friction_work_J": ledger.friction_work,
        "load_work_J": ledger.load_work,
        "ice_heat_J": ledger.ice_heat,
        "rubber_heat_J": ledger.rubber_heat,
        "latent_heat_J": ledger.latent_heat,
        "elastic_energy_J": ledger.elastic_energy,
        "kinetic_energy_J": ledger.kinetic_energy,
        "energy_imbalance": ledger.imbalance,
        "newton_iterations": accepted.iterations if accepted else 0,
    }


def interface_fields(sliding: Sliding, accepted: Accepted | None) -> dict[str, Array]:
    """Fields on the contact points for output, (f, q), by their names with units. Collective.

    NaN where there is no contact and so no film: a facet's mean leaves those points out.
    """
    moment = sliding.moment
    shape = moment.contact.pressure.shape
    melted, saturated = _switches(sliding, accepted)
    squeezed = sliding.carrier.at_points(moment.interface.squeezed_height, moment.side)
    always = ("contact pressure (Pa)", "friction stress (Pa)")
    fields = {
        "contact pressure (Pa)": moment.contact.pressure,
        "friction stress (Pa)": sliding.shear(moment.interface, moment.side),
        "film height (m)": sliding.carrier.film_height(moment.interface, moment.side),
        "squeezed height (m)": squeezed,
        "surface temperature (degC)": _surface(sliding, moment) - MELTING_TEMPERATURE,
        "melted (1)": melted,
        "saturated (1)": saturated,
    }
    touching = moment.contact.pressure > 0.0
    return {
        name: np.where(touching | (name in always), np.reshape(values, shape), np.nan)
        for name, values in fields.items()
    }


def outside_table(block: Block, contact: ContactState) -> float:
    """Share of the contact area whose pressure the table of k, D, H_V does not cover."""
    touching = contact.pressure > 0.0
    outside = touching & block.friction.outside(contact.pressure)
    total = _contact_area(block, contact)
    return block.surface.total(outside * 1.0, contact.area) / total if total > 0.0 else 0.0


def _contact_area(block: Block, contact: ContactState) -> float:
    return block.surface.total((contact.pressure > 0.0) * 1.0, contact.area)


def _surface(sliding: Sliding, moment: Moment) -> Array:
    """Temperature of the ice at the points (K); no reading may be above T_m. Collective."""
    temperature = sliding.carrier.ice_temperature(moment.interface, moment.side)
    return np.minimum(temperature, MELTING_TEMPERATURE)


def _switches(sliding: Sliding, accepted: Accepted | None) -> tuple[Array, Array]:
    """Melting and saturation at the points, 0 to 1; nowhere at t = 0. Collective."""
    if accepted is None:
        nowhere = np.zeros(sliding.block.surface.n_points)
        return nowhere, nowhere
    last, side = accepted.passage.step.last, accepted.side
    carrier = sliding.carrier
    melting, saturated = last.melting.astype(float), last.saturated.astype(float)
    return carrier.at_points(melting, side), carrier.at_points(saturated, side)
