"""The state of a sliding block between steps, and what an accepted step is."""

from __future__ import annotations

from typing import NamedTuple

from iceslide_fem.arrays import Array
from iceslide_fem.coupling.energy import Energies, Mechanics
from iceslide_fem.coupling.passage import Passage
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.carriers import ContactLoads
from iceslide_fem.rubber.contact import ContactState
from iceslide_fem.rubber.time_discretisation import Motion
from iceslide_fem.rubber.wall_friction import Grip


class CoupledState(NamedTuple):
    """Everything that a step starts from: committed as a whole, or not at all.

    time (s); motion: of the block when it was last solved for; contact and solved_shear (of the
    points, Pa): of then; loads: the rubber's points, (n,); interface: film and ice; mechanics: what
    the block does and stores; steady: whether the last step changed the shear so little that the
    block may rest; grip: of its walls on each other, None without friction there; way: of the block
    over the ice since t = 0, m; strongest: largest friction force since then, N.
    """

    time: float
    motion: Motion
    contact: ContactState
    loads: ContactLoads
    interface: InterfaceState
    mechanics: Mechanics
    solved_shear: Array
    steady: bool
    grip: Grip | None = None
    way: float = 0.0
    strongest: float = 0.0


class Memory(NamedTuple):
    """What a slide remembers between two steps: the rest of its state follows from it.

    time and step, the length of the next (s), film_step: of the next of film and heat; start:
    displacements at t = 0; motion, speed, shear (of the points, m/s and Pa), offset and way (m),
    interface, steady, strongest and grip as in `CoupledState`.
    """

    time: float
    step: float
    film_step: float
    start: Array
    motion: Motion
    speed: Array
    shear: Array
    offset: float
    interface: InterfaceState
    steady: bool
    way: float
    strongest: float
    grip: Grip | None


class Accepted(NamedTuple):
    """An accepted step: the state it leads to, and what happened on the way.

    dt: its length, and following: that of the next one by its errors, s; passage: of film and heat;
    energies: its entries in the ledger; loads: the rubber's points at its end, before the window
    moved; iterations: Newton's; solved: whether the block was solved; squeezed_water: what contact
    has squeezed out in it, lost_water: what was scraped off or has left the window of ice, m3;
    rejected: steps refused before.
    """

    state: CoupledState
    dt: float
    following: float
    passage: Passage
    energies: Energies
    loads: ContactLoads
    iterations: int
    solved: bool
    squeezed_water: float
    lost_water: float
    rejected: int = 0
