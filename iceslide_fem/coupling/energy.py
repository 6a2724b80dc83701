"""Energy balance of a step: work of the plate against energy taken by film, ice and rubber.

A trial step whose energy balance does not close is rejected (`coupling.accept`). The ledger sums
the energies of accepted steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.time_discretisation import Motion, MotionLaw
from iceslide_fem.mechanics.viscoelasticity import Relaxed
from iceslide_fem.runtime.arrays import Array


class Mechanics(NamedTuple):
    """Forces and stored energies of the whole block at one time.

    friction_force, N; plate_displacement, m; elastic_energy: of rubber and contact penalties, J;
    kinetic_energy: relative to the plate, J; mass_moment: mass times displacement of its centre
    along x relative to the plate, kg m.
    """

    friction_force: float
    plate_displacement: float
    elastic_energy: float
    kinetic_energy: float
    mass_moment: float


class Energies(NamedTuple):
    """Energies of the whole block over a step or a run, J.

    friction_work: work of the plate against friction, F v; load_work: work of the plate's weight,
    and of the inertial force - dv/dt m du of rubber that accelerates with the plate; ice_heat,
    rubber_heat, latent_heat: heat from the interface; hysteresis_heat: made in the rubber on rough
    ice; wall_heat: frictional heat of self-contact;
    rubber_dissipation: viscoelastic dissipation; elastic_energy, kinetic_energy: changes of the
    stored energies. The first two should equal the sum of the others.
    """

    friction_work: float = 0.0
    load_work: float = 0.0
    ice_heat: float = 0.0
    rubber_heat: float = 0.0
    latent_heat: float = 0.0
    hysteresis_heat: float = 0.0
    wall_heat: float = 0.0
    rubber_dissipation: float = 0.0
    elastic_energy: float = 0.0
    kinetic_energy: float = 0.0

    @property
    def missing(self) -> float:
        """Work of the plate minus all energy taken, J: the error of the balance."""
        taken = self.ice_heat + self.rubber_heat + self.latent_heat + self.wall_heat
        taken += self.hysteresis_heat + self.rubber_dissipation
        kept = self.elastic_energy + self.kinetic_energy
        return self.friction_work + self.load_work - taken - kept


def mechanics_of(
    block: Block,
    shear: Array,
    area: Array,
    motion_law: MotionLaw,
    motion: Motion,
    relaxed: Relaxed | None,
) -> Mechanics:
    """Forces and stored energies of `block` at its present displacements. Collective.

    `motion` has the same displacements. `shear` (Pa) acts on `area` (m2), both (n,). `relaxed` has
    the internal variables of viscoelastic rubber.
    """
    contact, scale = block.contact, block.scale
    penalty = 0.5 * contact.pressure**2 / block.equilibrium.penalty
    sunk = block.surface.total(penalty, contact.area)
    return Mechanics(
        block.total(shear, area),
        block.equilibrium.plate_displacement(),
        scale * (block.rubber.elastic_energy(relaxed) + sunk),
        scale * motion_law.kinetic_energy(motion),
        scale * motion_law.mass_moment(motion),
    )


def step_energies(
    block: Block,
    subcycles: Subcycles,
    forces: Sequence[float],
    time: float,
    dt: float,
    before: Mechanics,
    after: Mechanics,
    wall_heat: float,
    rubber_dissipation: float,
    stored: float,
) -> Energies:
    """Energies of a step of `dt` (s) from `time` that leads from `before` to `after`. Collective.

    `wall_heat` (J) is the frictional heat of self-contact, `rubber_dissipation` (J) the
    viscoelastic dissipation; `stored` (J) goes into the springs of points that stick. The plate's
    force and speed are straight lines over the step, and so is friction between the `forces` (N) at
    its start and after each of the `subcycles`.
    """
    load, end = block.scene.load, time + dt
    times = [time, *(time + fraction * dt for fraction in subcycles.ends)]
    work = 0.0
    for (first, last), (force, final) in zip(pairwise(times), pairwise(forces), strict=True):
        nonlinearity = (final - force) / 12.0 * (load.speeds.at(last) - load.speeds.at(first))
        mean = 0.5 * (force + final) * load.speeds.mean_between(first, last)
        work += (mean + nonlinearity) * (last - first)
    acceleration = (load.speeds.at(end) - load.speeds.at(time)) / dt
    carried = acceleration * (after.mass_moment - before.mass_moment)
    weight = load.pressures.mean_between(time, end) * block.area

    def total(heat: str) -> float:
        parts = [getattr(one.step, heat) for one in subcycles.substeps]
        return block.total(np.concatenate(parts), subcycles.area)

    return Energies(
        friction_work=work,
        load_work=block.scale * weight * (after.plate_displacement - before.plate_displacement)
        - carried,
        ice_heat=total("ice_heat"),
        rubber_heat=total("rubber_heat"),
        latent_heat=total("latent_heat"),
        hysteresis_heat=total("hysteresis_heat"),
        wall_heat=wall_heat,
        rubber_dissipation=rubber_dissipation,
        elastic_energy=after.elastic_energy - before.elastic_energy + stored,
        kinetic_energy=after.kinetic_energy - before.kinetic_energy,
    )
