"""Wall-clock limit of a run: that of the scene, else a stop if its remaining time keeps growing."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic
from typing import NamedTuple, Protocol

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.output.table import HistoryRow, of_pass
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene


class Observation(NamedTuple):
    """The sliding block at the present time, the step before (None at t = 0), and its row."""

    sliding: Sliding
    accepted: AcceptedStep | None
    row: HistoryRow

    @property
    def time(self) -> float:
        """Sliding time of all passes, s."""
        return self.sliding.current.time

    @property
    def history_row(self) -> HistoryRow:
        """The row of `history.csv`; for several passes with the pass, and time with rests."""
        load, number = self.sliding.block.scene.load, self.sliding.number
        if load.passes == 1:
            return self.row
        return of_pass(self.row, number, (number - 1) * load.rest)

    @property
    def solved(self) -> bool:
        """Whether equilibrium was solved in this step; else displacements are unchanged."""
        return self.accepted is None or self.accepted.solved


class Observer(Protocol):
    """A callable that receives observations."""

    def __call__(self, step: Observation, /) -> None:
        """Handle t = 0 or an accepted step."""


WINDOW = 100  # steps over which the pace is measured
# A run is stopped if, at the present pace, more than this number of steps remain, this many times
# more than the least number before, and they would take longer than this (s). Usual runs have
# hundreds or thousands of steps.
MANY_STEPS, GROWTH, LONG = 1e5, 3.0, 3600.0


class TimeLimit:
    """`numerics.time_limit`, counted from the creation of this object."""

    def __init__(
        self, scene: Scene, comm: MPI.Comm, clock: Callable[[], float] = monotonic
    ) -> None:
        """`clock`: returns seconds; rank 0's is used."""
        self._limit, self._comm, self._clock = scene.numerics.time_limit, comm, clock
        self._start = clock()

    def over(self) -> str:
        """Reason to stop the run now, or "". Collective."""
        if self._limit is None:
            return ""
        over = self._comm.bcast(self._clock() - self._start > self._limit)
        return f"numerics.time_limit = {self._limit:g} s is over" if over else ""

    def handle_signals(self, where: str) -> None:
        """Raise SimulationStopped with `where` if the limit is over before sliding. Collective."""
        why = self.over()
        if why:
            raise SimulationStopped(f"the run stops before sliding, {where}: {why}")


class Pace:
    """Observer that stops a run with growing remaining time, unless it has a time limit."""

    def __init__(
        self, sliding: Sliding, save: Callable[[], None], clock: Callable[[], float] = monotonic
    ) -> None:
        """save: writes a checkpoint; clock: returns seconds."""
        self._sliding, self._save, self._clock = sliding, save, clock
        scene = sliding.block.scene
        self._limited, self._duration = (
            scene.numerics.time_limit is not None,
            scene.load.sliding_time,
        )
        self._fewest_left = float("inf")
        self._steps, self._before = 0, (sliding.current.time, self._now())

    def __call__(self, step: Observation) -> None:
        """Raise SimulationStopped if the run should stop. Collective."""
        if self._limited or step.accepted is None or step.time >= self._duration:
            return
        self._steps += 1
        if self._steps % WINDOW:
            return
        (time_before, clock_before), now = self._before, self._now()
        self._before = step.time, now
        left = WINDOW * (self._duration - step.time) / (step.time - time_before)
        seconds = left * (now - clock_before) / WINDOW
        self._fewest_left = min(self._fewest_left, left)
        if left > MANY_STEPS and left > GROWTH * self._fewest_left and seconds > LONG:
            self._save()
            raise SimulationStopped(
                f"the run stops at {self._sliding.moment}: its end recedes: at the present pace "
                f"{left:.2g} steps and {seconds / 3600:.2g} hours are left (numerics.time_limit "
                f"lets it go on); {self._sliding.block.limit_met()}"
            )

    def _now(self) -> float:
        """The clock of rank 0. Collective."""
        return float(self._sliding.block.surface.comm.bcast(self._clock()))
