"""Acceptance of a trial step, and the update of water and ice window that follows it.

A step is accepted if friction does not push the block, if its energy balance closes, and if the
block stays inside its window of ice. Water and the window of ice then follow the block.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.drainage import Drainage
from iceslide_fem.coupling.energy import step_energies
from iceslide_fem.coupling.state import AcceptedStep, CoupledState, WaterFlows
from iceslide_fem.coupling.step_error import StepError, StepRejected
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.interface.film_frame import FilmFrame, Travel
from iceslide_fem.mechanics.block import Block

NEXT_SUBSTEPS = 0.9  # the next step aims at this fraction of the allowed substeps


class CorrectedStep(NamedTuple):
    """A trial step after block and film have been corrected.

    after: the state at its end, before water and window follow the block; dt: step length, s;
    subcycles: substeps of film and heat; forces: friction force of the block at the start and after
    each substep, N; factor: next step length over this one, from the errors; iterations: Newton
    iterations; solved: whether equilibrium was solved; wall_heat: frictional heat of self-contact,
    J; dissipation: viscoelastic dissipation, J; stored: energy into the springs of points that
    stick, J.
    """

    after: CoupledState
    dt: float
    subcycles: Subcycles
    forces: list[float]
    factor: float
    iterations: int = 0
    solved: bool = False
    wall_heat: float = 0.0
    dissipation: float = 0.0
    stored: float = 0.0


class Acceptance:
    """Judges trial steps of `block` on `frame`. All is collective."""

    def __init__(
        self, block: Block, frame: FilmFrame, drainage: Drainage, error: StepError, adaptive: bool
    ) -> None:
        """`adaptive`: whether the step length is free; fixed steps cannot be shortened."""
        self._block, self._frame, self._error = block, frame, error
        self._drainage = drainage
        self._adaptive = adaptive
        # When the plate slows down, the rubber springs back and friction may change sign. A free
        # oscillation releases the stored energy only: its force never exceeds the friction force
        # that sheared the rubber. Points that stick hold the block either way.
        self._may_swing = block.scene.load.changes

    def of(self, start: CoupledState, corrected: CorrectedStep) -> AcceptedStep:
        """The accepted step that leads from `start` to `corrected`. Raises StepRejected."""
        dt, force, most = corrected.dt, corrected.forces[-1], 0.0
        after, subcycles = corrected.after, corrected.subcycles
        if self._may_swing:
            most = max(start.largest_friction_force, self._error.least_friction)
        if not (force > 0.0 or -force <= most or after.stuck):
            with_what = " with more than it was sheared by" if self._may_swing else ""
            what = f"rubber that springs back would push the block forward{with_what}"
            raise StepRejected(what, 0.25)
        energies = step_energies(
            self._block,
            subcycles,
            corrected.forces,
            start.time,
            dt,
            start.mechanics,
            after.mechanics,
            corrected.wall_heat,
            corrected.dissipation,
            corrected.stored,
        )
        unclosed = self._error.of_energy(energies, dt, force, after.stuck)
        shorter = float(step_factor(unclosed, 2))
        if unclosed > 1.0 and self._adaptive:  # a fixed step cannot be shortened
            raise StepRejected("the step's energy does not close: the block snaps", shorter)
        after = after._replace(largest_friction_force=max(start.largest_friction_force, force))
        shifted, water = self._drained(start, after, subcycles)
        # the number of substeps grows in proportion to the step
        most = NEXT_SUBSTEPS * self._error.limits.most_substeps / len(subcycles.substeps)
        return AcceptedStep(
            shifted,
            dt,
            dt * min(corrected.factor, shorter, most),
            subcycles,
            energies,
            after.loads,
            corrected.iterations,
            corrected.solved,
            water,
        )

    def _drained(
        self, start: CoupledState, after: CoupledState, subcycles: Subcycles
    ) -> tuple[CoupledState, WaterFlows]:
        """The state after water and the ice window have followed the block, and the water flows."""
        block, frame, loads = self._block, self._frame, after.loads
        if not block.surface.comm.allreduce(frame.reaches(loads), op=MPI.LAND):
            raise StepRejected("the block leaves its window of ice", 0.25)
        before = start.loads, loads, start.sliding_distance
        moved, wiped = frame.water_moved(after.interface, *before)
        if moved is not after.interface:
            # The next step begins with the friction above the moved water.
            shear = frame.sheared(moved, loads)(loads.pressure, loads.speed)[0]
            force = block.total(shear, loads.area)
            mechanics = after.mechanics._replace(friction_force=force)
            after = after._replace(interface=moved, mechanics=mechanics)
        drained = self._drainage.after(start, after, subcycles, wiped)
        distance = start.sliding_distance + (loads.offset - start.loads.offset)
        travel = Travel(loads.offset, distance, start.ahead)
        shifted = frame.shift_window(drained.interface, travel)
        if shifted.offset != loads.offset:  # else the next step reuses their caches
            loads = replace(loads, offset=shifted.offset)
        after = after._replace(
            interface=shifted.state, loads=loads, sliding_distance=distance, stored=drained.stored
        )
        gains = np.concatenate([one.step.squeezed for one in subcycles.substeps])
        flows = (
            block.total(gains, subcycles.area) + block.scale * drained.flowed_out,
            block.scale * (shifted.brought + drained.covered),
            block.scale * (drained.lost + shifted.left),
            block.scale * drained.pushed_out,
        )
        return after, WaterFlows(*flows)
