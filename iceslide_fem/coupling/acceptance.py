"""What a trial step has to show before it is accepted, and what then follows it.

Its energies are those of friction, and they close; the block is still above its ice. Water and the
window of ice follow the block.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.energy import step_energies
from iceslide_fem.coupling.films import MOST_STEPS
from iceslide_fem.coupling.passage import Passage
from iceslide_fem.coupling.state import Accepted, CoupledState
from iceslide_fem.coupling.step_error import Refused, StepError
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.interface.carriers import Carrier
from iceslide_fem.rubber.block import Block

MORE_STEPS = 0.9  # of the sub-steps that a step may have, in the next one


class Found(NamedTuple):
    """What a trial step leads to.

    after: its state, before water and the window have followed; dt: its length, s; passage: of film
    and heat; forces: friction of the block at its start and at the ends of the parts of `passage`,
    N; factor: on the next step's length, by its errors; iterations: Newton's; solved: whether the
    block was solved; wall_heat: of walls that have slipped, J.
    """

    after: CoupledState
    dt: float
    passage: Passage
    forces: list[float]
    factor: float
    iterations: int = 0
    solved: bool = False
    wall_heat: float = 0.0


class Acceptance:
    """Judges trial steps of `block` on `carrier`. All is collective."""

    def __init__(self, block: Block, carrier: Carrier, error: StepError, adaptive: bool) -> None:
        """`adaptive`: whether somebody could choose a better step."""
        self._block, self._carrier, self._error = block, carrier, error
        self._adaptive = adaptive
        # A plate that slows down lets rubber spring back, with what it has stored: swinging freely
        # it pushes with no more than the friction that sheared it.
        self._may_swing = block.scene.load.changes

    def of(self, start: CoupledState, found: Found) -> Accepted:
        """The step from `start` as it is accepted. Raises Refused."""
        dt, force, most = found.dt, found.forces[-1], 0.0
        if self._may_swing:
            most = max(start.strongest, self._error.least_friction)
        if not (force > 0.0 or -force <= most):
            with_what = " with more than it was sheared by" if self._may_swing else ""
            raise Refused(f"rubber that springs back would push the block forward{with_what}", 0.25)
        after, passage = found.after, found.passage
        energies = step_energies(
            self._block,
            passage,
            found.forces,
            start.time,
            dt,
            start.mechanics,
            after.mechanics,
            found.wall_heat,
        )
        unclosed = self._error.of_energy(energies, dt, force)
        shorter = float(step_factor(unclosed, 2))
        if unclosed > 1.0 and self._adaptive:  # else nobody could choose a better step
            raise Refused("the step's energy does not close: the block snaps", shorter)
        squeezed = self._squeezed(passage)
        after = after._replace(strongest=max(start.strongest, force))
        shifted, lost = self._window_shifted(start, after)
        # a step twice as long would take film and heat twice as many of their own
        most = MORE_STEPS * MOST_STEPS / len(passage.steps)
        return Accepted(
            shifted,
            dt,
            dt * min(found.factor, shorter, most),
            passage,
            energies,
            after.loads,
            found.iterations,
            found.solved,
            squeezed,
            lost,
        )

    def _squeezed(self, passage: Passage) -> float:
        """Water that leaves the films of the whole block in `passage`, m3. Collective."""
        gains = [one.step.squeezed for one in passage.steps]
        return self._block.total(np.concatenate(gains), passage.area)

    def _window_shifted(
        self, start: CoupledState, after: CoupledState
    ) -> tuple[CoupledState, float]:
        """The state after water and the window of ice have followed the block; lost water, m3."""
        carrier, loads = self._carrier, after.loads
        comm = self._block.surface.comm
        if not comm.allreduce(carrier.reaches(loads), op=MPI.LAND):
            raise Refused("the block leaves its window of ice", 0.25)
        moved, lost = carrier.water_moved(after.interface, start.loads, loads, start.way)
        way = start.way + (loads.offset - start.loads.offset)
        interface, offset, left = carrier.window_shifted(moved, loads.offset)
        if offset != loads.offset:  # else they are the next step's own, with what is known of them
            loads = replace(loads, offset=offset)
        return after._replace(interface=interface, loads=loads, way=way), self._block.scale * (
            lost + left
        )
