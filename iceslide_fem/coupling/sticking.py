"""Points of the rubber that stick to the ice under friction that is not viscous.

Such friction has a strength S at rest. A point sticks while its shear is below it: a spring of the
contact's penalty eps then ties it to its place on the ice, as points of self-contact to their
anchors (`rubber.self_contact_friction`). In a step of dt from the shear tau_0 to the slip speed v,
with the strength S of the friction law,

    tau = tau_0 + eps dt v    where its size is below S: the point sticks,
          S or -S             elsewhere: it slips to this side,

the radial return of elastoplastic friction (P. Wriggers, Computational Contact Mechanics, 2nd ed.,
Springer 2006, sec. 10.5). S is that at the speed of slip to the side of tau, or at rest. The spring
yields by S / eps, at most a hundredth of what the block's height does
(`mechanics.contact.penalty`).

The law and its film see the slip of a point, without direction. Points that stick have the slip
speed `RESTS` there: its heat is nothing, and errors of their films keep a weight. Nodes of the ice
have the mean slip of their points. A point that sticks beside one that slips would take the
difference for a film: while points stick, all read their films at `STILL`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.coupling.state import CoupledState
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.interface.film_frame import ContactLoads, FilmFrame, InterfaceStep
from iceslide_fem.laws.protocol import InterfaceLaw, Sheared
from iceslide_fem.mechanics.block import Block
from iceslide_fem.runtime.arrays import Array, Mask

# Slip speed (m/s) at which strength at rest is read. Dry shear falls below a smaller one
# (`film.limiting_shear.SLOWEST`).
STILL = 2e-6
RESTS = 1e-9  # m/s, slip speed of points that stick


class Shearing(Protocol):
    """Shear of the points over a step; some: whether any of them, on all ranks, sticks."""

    @property
    def some(self) -> bool:
        """Whether points stick."""

    def read(self, frame: FilmFrame, end: InterfaceStep, loads: ContactLoads) -> Sheared:
        """The shear law of the points under `loads`, at the `end` of a substep. Collective."""

    def begin(
        self, start: CoupledState, loads: ContactLoads, slid: float, dt: float
    ) -> ContactLoads:
        """Loads at the start of a step of `dt` (s) to `loads` in which the plate has `slid` (m)."""

    def shear(self, sheared: Sheared, loads: ContactLoads, fraction: float = 1.0) -> Array:
        """Shear (n,), Pa, at a `fraction` of the step, where the law is `sheared`."""

    def stored(self, block: Block, area: Array) -> float:
        """Energy that goes into the springs of sticking points of the `block`, J. Collective."""


class Friction(Protocol):
    """How the friction law of a block becomes shear."""

    def law(self, start: CoupledState, dt: float, sheared: Sheared) -> Sheared:
        """Shear over pressure and signed slip speed at the end of a step of `dt` (s)."""

    def predicted(self, start: CoupledState, moved: ContactLoads) -> tuple[ContactLoads, Shearing]:
        """Loads and shear if the points have the slip speeds of `moved` at the end of the step."""

    def found(
        self, start: CoupledState, dt: float, sheared: Sheared, moved: ContactLoads
    ) -> tuple[ContactLoads, Shearing]:
        """The same with equilibrium under `law` at the slip speeds of `moved`."""

    def present(self, loads: ContactLoads, solved: Array, of_law: Array) -> Array:
        """Shear (n,), Pa, after a step; `solved` in its equilibrium, `of_law` under the loads.
        Collective.
        """


class Slipping:
    """Friction whose points always slip; their shear is that of the law."""

    some = False

    def read(self, frame: FilmFrame, end: InterfaceStep, loads: ContactLoads) -> Sheared:
        """That of the films around each point."""
        return frame.sheared(end.state, loads)

    def begin(
        self, start: CoupledState, loads: ContactLoads, slid: float, dt: float
    ) -> ContactLoads:
        """Those of `start`."""
        return start.loads

    def shear(self, sheared: Sheared, loads: ContactLoads, fraction: float = 1.0) -> Array:
        """The shear of the law under the `loads`."""
        return sheared(loads.pressure, loads.speed)[0]

    def stored(self, block: Block, area: Array) -> float:
        """0."""
        return 0.0

    def law(self, start: CoupledState, dt: float, sheared: Sheared) -> Sheared:
        """The law itself."""
        return sheared

    def predicted(self, start: CoupledState, moved: ContactLoads) -> tuple[ContactLoads, Shearing]:
        """The loads unchanged."""
        return moved, self

    def found(
        self, start: CoupledState, dt: float, sheared: Sheared, moved: ContactLoads
    ) -> tuple[ContactLoads, Shearing]:
        """The loads unchanged."""
        return moved, self

    def present(self, loads: ContactLoads, solved: Array, of_law: Array) -> Array:
        """That of the law."""
        return of_law


class Held(NamedTuple):
    """Shear over a step in which some points stick; arrays (n,).

    sticks: mask; first, last: their shear at the ends of the step, Pa; side: 1 or -1, to which the
    other points slip; penalty: eps, Pa/m; law: of the films; some: whether any point of all ranks
    sticks.
    """

    sticks: Mask
    first: Array
    last: Array
    side: Array
    penalty: float
    law: InterfaceLaw
    some: bool

    def read(self, frame: FilmFrame, end: InterfaceStep, loads: ContactLoads) -> Sheared:
        """That of the films around each point, at one slip speed if points stick."""
        state = end.state
        if self.some:
            state = self.law.at_speed(state, STILL)
            loads = replace(loads, speed=np.full_like(loads.speed, STILL))
        return frame.sheared(state, loads)

    def begin(
        self, start: CoupledState, loads: ContactLoads, slid: float, dt: float
    ) -> ContactLoads:
        """Those of `start` with slip speeds whose mean over the step is the points' slip.

        The speed of a point may jump when others break loose. They are unchanged until points have
        stuck.
        """
        if not (start.stuck or self.some):
            return start.loads
        way = slid + loads.positions[:, 0] - start.loads.positions[:, 0]
        speed = np.maximum(2.0 * self.side * way / dt - loads.speed, RESTS)
        return replace(start.loads, speed=np.where(self.sticks & _rests(start.loads), RESTS, speed))

    def shear(self, sheared: Sheared, loads: ContactLoads, fraction: float = 1.0) -> Array:
        """Between the ends where points stick, else that of the law; reversed slip is rest."""
        slips = self.side * sheared(loads.pressure, np.maximum(loads.speed, STILL))[0]
        return np.where(self.sticks, self.first + fraction * (self.last - self.first), slips)

    def stored(self, block: Block, area: Array) -> float:
        """Change of tau^2 / (2 eps) of the points that stick."""
        energy = 0.5 * (self.last**2 - self.first**2) / self.penalty
        return block.total(np.where(self.sticks, energy, 0.0), area)


class Sticking:
    """Friction of a `block` whose points stick and slip. Its methods are collective."""

    def __init__(self, block: Block) -> None:
        self._penalty, self._interface_law = block.equilibrium.penalty, block.law
        self._comm = block.surface.comm

    def law(self, start: CoupledState, dt: float, sheared: Sheared) -> Sheared:
        """tau and its derivatives. Points that stick do not feel the pressure."""
        stiffness = self._penalty * dt

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            trial = start.solved_shear.reshape(pressure.shape) + stiffness * speed
            side, along = _slip(trial, speed)
            strength, by_pressure, by_speed = sheared(pressure, along)
            slips = np.abs(trial) >= strength
            return (
                np.where(slips, side * strength, trial),
                np.where(slips, side * by_pressure, 0.0),
                np.where(slips, np.where(along > STILL, by_speed, 0.0), stiffness),
            )

        return shear

    def predicted(self, start: CoupledState, moved: ContactLoads) -> tuple[ContactLoads, Shearing]:
        """Points that stick go on to stick; those that would slip back stick from now on."""
        first = start.solved_shear
        side, along = _slip(first, moved.speed)
        sticks = _rests(start.loads) | (along <= STILL)
        slip = replace(moved, speed=np.where(sticks, RESTS, along))
        return slip, self._held(sticks, first, first, side)

    def found(
        self, start: CoupledState, dt: float, sheared: Sheared, moved: ContactLoads
    ) -> tuple[ContactLoads, Shearing]:
        """Points stick where their shear is below the strength."""
        first = start.solved_shear
        trial = first + self._penalty * dt * moved.speed
        side, along = _slip(trial, moved.speed)
        sticks = np.abs(trial) < sheared(moved.pressure, along)[0]
        slip = replace(moved, speed=np.where(sticks, RESTS, along))
        return slip, self._held(sticks, first, trial, side)

    def present(self, loads: ContactLoads, solved: Array, of_law: Array) -> Array:
        """That of equilibrium if any point sticks, else that of the law."""
        return solved if self._some(_rests(loads)) else np.copysign(of_law, solved)

    def _held(self, sticks: Mask, first: Array, last: Array, side: Array) -> Held:
        data = self._penalty, self._interface_law, self._some(sticks)
        return Held(sticks, first, last, side, *data)

    def _some(self, points: Mask) -> bool:
        """Whether the mask holds any point of all ranks. Collective."""
        return bool(self._comm.allreduce(bool(points.any()), op=MPI.LOR))


def friction_of(block: Block) -> Friction:
    """The friction of a `block`; nothing sticks under a viscous law, or under constant loads."""
    if block.law.viscous or not block.scene.load.changes:
        return Slipping()
    return Sticking(block)


def _slip(shear: Array, speed: Array) -> tuple[Array, Array]:
    """The side to which a `shear` (Pa) slips, and the `speed` (m/s) to it, at least `STILL`."""
    side = np.copysign(1.0, shear)
    return side, np.maximum(side * speed, STILL)


def _rests(loads: ContactLoads) -> Mask:
    """Mask of the points that stuck, or just began to slip, at the end of a step."""
    return np.asarray(loads.speed <= STILL)
