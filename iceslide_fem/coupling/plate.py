"""The plate's prescribed force and speed, and the contact loads of the rubber's points on ice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.mechanics.block import Block, SpeedLaw
from iceslide_fem.mechanics.time_discretisation import Rate
from iceslide_fem.mesh.ice import window_cell
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.course import SAMPLED


class Plate:
    """The plate of `block`: its force and speed over time, and the contact points it moves.

    passing: time in which sliding ice moves by one cell at the largest speed, s; infinite without.
    """

    def __init__(self, block: Block) -> None:
        """Take force and speed from the block's scene."""
        self._block, load = block, block.scene.load
        near = SAMPLED * block.scene.numerics.tolerance
        self._pressures = load.pressures.sampled(near)
        self._speeds = load.speeds.sampled(near)
        self.passing = np.inf
        if block.scene.ice.motion == "sliding":
            self.passing = window_cell(block.scene) / self._speeds.largest

    def force(self, time: float) -> float:
        """The plate's force at `time` (s), relative to its force at t = 0."""
        return self._pressures.at(time) / self._pressures.first

    def force_holds(self, since: float, time: float) -> bool:
        """Whether the force at `time` (s) equals the force at `since` (s)."""
        return self._pressures.at(since) == self._pressures.at(time)

    def next_corner(self, now: float) -> float:
        """The next time (s) at which the plate's force or speed has a corner."""
        return float(min(self._pressures.next_corner(now), self._speeds.next_corner(now)))

    def kinks(self, time: float) -> tuple[float, float]:
        """Jumps at `time` (s) of the relative rate of the force, 1/s, and of the acceleration,
        m/s2.
        """
        return self._pressures.bend(time) / self._pressures.at(time), self._speeds.bend(time)

    def slid(self, now: float, dt: float) -> float:
        """Distance that the plate slides in a step of `dt` from `now` (s), m."""
        return self._speeds.mean_between(now, now + dt) * dt

    def ice_passed(self, now: float, dt: float) -> float:
        """Distance that ice slides in a step of `dt` from `now` (s), m; 0 of ice at rest."""
        return self.slid(now, dt) if self.passing < np.inf else 0.0

    def slip(self, rate: Rate, time: float) -> SpeedLaw:
        """Slip speed at `time` (s): speed of the plate plus rubber velocity relative to it.

        It depends on the unknown displacement (implicit). A lagged slip speed is unstable for steps
        below tau H / (v G), some ten microseconds.
        """
        surface, speed = self._block.surface, self._speeds.at(time)
        dim = self._block.rubber.mesh.geometry.dim
        known = speed + surface.displacements(rate.intercept.reshape(-1, dim))[..., 0]
        return lambda displacement: (known + rate.slope * displacement, rate.slope)

    def loads(self, speed: Array, offset: float) -> ContactLoads:
        """Contact loads at the block's present displacements and slip speeds (n,), m/s."""
        surface, contact = self._block.surface, self._block.contact
        positions = surface.positions(self._block.rubber.displacements)[..., :-1]
        return ContactLoads(
            positions.reshape(surface.n_points, positions.shape[-1]),
            contact.pressure.ravel(),
            contact.area.ravel(),
            speed,
            offset,
        )

    def first_loads(self) -> ContactLoads:
        """Contact loads at t = 0: all points slip at the plate's speed."""
        return self.loads(np.full(self._block.surface.n_points, self._speeds.first), 0.0)

    def slipping(self, speed: SpeedLaw, offset: float) -> ContactLoads:
        """Contact loads at the block's present displacements, with slip speeds from `speed`."""
        present = self._block.surface.displacements(self._block.rubber.displacements)
        return self.loads(speed(present[..., 0])[0].ravel(), offset)

    def with_still_rubber(self, loads: ContactLoads, time: float) -> ContactLoads:
        """The `loads` with the plate's speed at `time` (s): rubber at rest relative to the
        plate.
        """
        return replace(loads, speed=np.full_like(loads.speed, self._speeds.at(time)))

    def faster(self, loads: ContactLoads, by: Array) -> ContactLoads:
        """The `loads` with rubber velocities `by` (dofs,), m/s, added to the slip speeds."""
        surface, dim = self._block.surface, self._block.rubber.mesh.geometry.dim
        change = surface.displacements(by.reshape(-1, dim))[..., 0].ravel()
        return replace(loads, speed=loads.speed + change)
