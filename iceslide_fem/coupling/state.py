"""The state of a sliding block between steps, and what an accepted step is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.energy import Energies, Mechanics
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.rubber.contact import ContactState
from iceslide_fem.rubber.self_contact_friction import StickPoints
from iceslide_fem.rubber.time_discretisation import Motion
from iceslide_fem.rubber.viscoelasticity import Relaxed
from iceslide_fem.runtime.arrays import Array


class WaterFlows(NamedTuple):
    """Water of the whole block over a step or a run, m3.

    squeezed_water: what contact has squeezed out of films; brought_water: what ice has brought;
    lost_water: what was wiped off or has left the window of ice; pushed_out_water: what has flowed
    out from below the lugs and into no sipe.
    """

    squeezed_water: float = 0.0
    brought_water: float = 0.0
    lost_water: float = 0.0
    pushed_out_water: float = 0.0


class CoupledState(NamedTuple):
    """Everything that a step starts from: committed as a whole, or not at all.

    time (s); motion: of the block when it was last solved for; contact and solved_shear (of the
    points, Pa): of then; loads: the rubber's points, (n,); interface: film and ice; mechanics: what
    the block does and stores; quiescent: whether the last step changed the shear so little that
    mechanics may be skipped; relaxed: of rubber that relaxes, None if it is elastic; stick_points:
    of its walls on each other, None without friction there; sliding_distance: of the block over the
    ice since t = 0, m; largest_friction_force: since then, N; stored: water in the sipes, (sipes,),
    m3 (m2 in a slice).
    """

    time: float
    motion: Motion
    contact: ContactState
    loads: ContactLoads
    interface: InterfaceState
    mechanics: Mechanics
    solved_shear: Array
    quiescent: bool
    relaxed: Relaxed | None = None
    stick_points: StickPoints | None = None
    sliding_distance: float = 0.0
    largest_friction_force: float = 0.0
    stored: Array = np.zeros(0)


class CheckpointState(NamedTuple):
    """All that later steps depend on between two steps: the rest of the state follows from it.

    time and dt, the length of the next step (s), film_dt: of the next substep of film and heat;
    start: displacements at t = 0; speed, shear (of the points, m/s and Pa) and offset (m): of the
    loads; the others as in `CoupledState`.
    """

    time: float
    dt: float
    film_dt: float
    start: Array
    motion: Motion
    speed: Array
    shear: Array
    offset: float
    interface: InterfaceState
    quiescent: bool
    sliding_distance: float
    largest_friction_force: float
    stick_points: StickPoints | None
    relaxed: Relaxed | None
    stored: Array


class AcceptedStep(NamedTuple):
    """An accepted step: the state it leads to, and what happened in it.

    dt: its length, and next_dt: that of the next one by its errors, s; subcycles: of film and heat;
    energies: its entries in the ledger; loads: the rubber's points at its end, before the window
    moved; iterations: Newton's; solved: whether the block was solved; water: its entries in the
    ledger; rejected: trial steps before that were not accepted.
    """

    state: CoupledState
    dt: float
    next_dt: float
    subcycles: Subcycles
    energies: Energies
    loads: ContactLoads
    iterations: int
    solved: bool
    water: WaterFlows
    rejected: int = 0
