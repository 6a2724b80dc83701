"""The state of a sliding block between steps, and an accepted step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.energy import Energies, Mechanics
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.mechanics.contact import ContactState
from iceslide_fem.mechanics.self_contact_friction import StickPoints
from iceslide_fem.mechanics.time_discretisation import Motion
from iceslide_fem.mechanics.viscoelasticity import Relaxed
from iceslide_fem.runtime.arrays import Array


class WaterFlows(NamedTuple):
    """Water of the whole block over a step or a run, m3.

    squeezed_water: squeezed out of films by contact; brought_water: brought in by new ice;
    lost_water: wiped off, or left behind by the window of ice; pushed_out_water: outflow from below
    the lugs that enters no sipe.
    """

    squeezed_water: float = 0.0
    brought_water: float = 0.0
    lost_water: float = 0.0
    pushed_out_water: float = 0.0


class CoupledState(NamedTuple):
    """The state at the start of a step. It is committed as a whole or not at all.

    time: s; motion: of the block at its last equilibrium; contact: of that equilibrium; loads: of
    the contact points, (n,); interface: film and ice; mechanics: forces and stored energies;
    solved_shear: shear of the last equilibrium, (n,), Pa; quiescent: whether the shear changes so
    little that mechanics may be skipped; relaxed: internal variables, None if elastic;
    stick_points: of self-contact, None without friction; stuck: whether points have stuck to the
    ice since the pass began; sliding_distance: of the block over ice since t = 0, m;
    largest_friction_force: since t = 0, N; stored: water in the sipes, (sipes,), m3 (m2 in a
    slice); ahead: a window of the ice that enters, None for that of the scene.
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
    stuck: bool = False
    sliding_distance: float = 0.0
    largest_friction_force: float = 0.0
    stored: Array = np.zeros(0)
    ahead: InterfaceState | None = None


class CheckpointState(NamedTuple):
    """The part of the state that a checkpoint saves; the rest follows from it.

    time: s; dt: length of the next step, s; film_dt: of the next substep of film and heat, s;
    start: displacements at t = 0; speed, shear, offset: of the contact points, m/s, Pa and m. The
    other fields are those of `CoupledState`.
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
    stuck: bool
    relaxed: Relaxed | None
    stored: Array
    ahead: InterfaceState | None


class AcceptedStep(NamedTuple):
    """An accepted step: the state at its end, and its data.

    dt: step length, s; next_dt: length that its errors allow for the next step, s; subcycles: of
    film and heat; energies, water: entries in the ledger; loads: contact loads at its end, before
    the window shifts; iterations: Newton iterations; solved: whether equilibrium was solved;
    rejected: number of rejected trial steps before it.
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
