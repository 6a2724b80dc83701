"""What the plate does to the block in time, and the rubber's points under it as loads on ice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.mesh.ice import window_cell
from iceslide_fem.rubber.block import Block, SpeedLaw
from iceslide_fem.rubber.time_discretisation import Rate
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.course import SAMPLED


class Plate:
    """The plate of `block`: its force and speed over time, and the points that it moves.

    passing (s): in which a cell of passing ice passes at the largest speed, infinite without.
    """

    def __init__(self, block: Block) -> None:
        """Force and speed as the block's scene has them."""
        self._block, load = block, block.scene.load
        near = SAMPLED * block.scene.numerics.tolerance
        self._pressures = load.pressures.sampled(near)
        self._speeds = load.speeds.sampled(near)
        self.passing = np.inf
        if block.scene.ice.motion == "sliding":
            self.passing = window_cell(block.scene) / self._speeds.largest

    def force(self, time: float) -> float:
        """The plate's force at `time` (s), relative to that at t = 0."""
        return self._pressures.at(time) / self._pressures.first

    def force_holds(self, since: float, time: float) -> bool:
        """Whether the force at `time` is what it was at another (s)."""
        return self._pressures.at(since) == self._pressures.at(time)

    def next_corner(self, now: float) -> float:
        """The next time (s) at which the plate's force or speed has a corner."""
        return float(min(self._pressures.next_corner(now), self._speeds.next_corner(now)))

    def kinks(self, time: float) -> tuple[float, float]:
        """By how much the rates of change of its force, over the force, and of its speed jump at
        `time` (s): 1/s and m/s2.
        """
        return self._pressures.bend(time) / self._pressures.at(time), self._speeds.bend(time)

    def ice_passed(self, now: float, dt: float) -> float:
        """How far ice passes in a step of `dt` from `now` (s), m."""
        return self._speeds.mean_between(now, now + dt) * dt if self.passing < np.inf else 0.0

    def slip(self, rate: Rate, time: float) -> SpeedLaw:
        """Slip speed at `time` (s): the plate's and that of the rubber relative to it.

        Taken at the displacement that is solved for: a lagged one is unstable for steps below
        tau H / (v G), some ten microseconds.
        """
        surface, speed = self._block.surface, self._speeds.at(time)
        dim = self._block.rubber.mesh.geometry.dim
        known = speed + surface.displacements(rate.intercept.reshape(-1, dim))[..., 0]
        return lambda displacement: (known + rate.slope * displacement, rate.slope)

    def loads(self, speed: Array, offset: float) -> ContactLoads:
        """The rubber's points at the block's present displacements, with slip speeds (n,), m/s."""
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
        """The rubber's points at t = 0, which slip at the plate's speed."""
        return self.loads(np.full(self._block.surface.n_points, self._speeds.first), 0.0)

    def slipping(self, speed: SpeedLaw, offset: float) -> ContactLoads:
        """The rubber's points at the block's present displacements, with slip speeds by a law."""
        present = self._block.surface.displacements(self._block.rubber.displacements)
        return self.loads(speed(present[..., 0])[0].ravel(), offset)

    def with_still_rubber(self, loads: ContactLoads, time: float) -> ContactLoads:
        """The rubber's points at `time` (s) if they do not move relative to the plate."""
        return replace(loads, speed=np.full_like(loads.speed, self._speeds.at(time)))

    def faster(self, loads: ContactLoads, by: Array) -> ContactLoads:
        """The rubber's points if they slip faster by velocities of the rubber (dofs,), m/s."""
        surface, dim = self._block.surface, self._block.rubber.mesh.geometry.dim
        change = surface.displacements(by.reshape(-1, dim))[..., 0].ravel()
        return replace(loads, speed=loads.speed + change)
