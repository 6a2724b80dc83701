"""How long a run may go on: to the limit that the scene gives, else until its end recedes."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.errors import SimulationStopped
from iceslide_fem.run.observers import Observation

WINDOW = 100  # steps over which the pace is taken
# The end recedes where at the present pace there are so many steps left, so many times more than
# there once were, and they would take so long (s). Steps of a run are hundreds or thousands.
MANY_STEPS, GROWTH, LONG = 1e5, 3.0, 3600.0


class Pace:
    """Stops a run at `numerics.time_limit`; without one, where its end recedes: an observer."""

    def __init__(
        self, sliding: Sliding, save: Callable[[], None], clock: Callable[[], float] = monotonic
    ) -> None:
        """`save` writes a checkpoint; `clock` gives seconds."""
        self._sliding, self._save, self._clock = sliding, save, clock
        scene = sliding.block.scene
        self._limit, self._duration = scene.numerics.time_limit, scene.load.duration
        self._start = self._now()
        self._fewest_left = float("inf")
        self._steps, self._before = 0, (sliding.current.time, self._start)

    def __call__(self, step: Observation) -> None:
        """Raise SimulationStopped if the run should not go on. Collective."""
        if step.accepted is None or step.time >= self._duration:
            return
        if self._limit is not None:
            if self._now() - self._start > self._limit:
                self._stop(f"numerics.time_limit = {self._limit:g} s is over")
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
            self._stop(
                f"its end recedes: at the present pace {left:.2g} steps and {seconds / 3600:.2g} "
                f"hours are left (numerics.time_limit lets it go on); "
                f"{self._sliding.block.limit_met()}"
            )

    def _now(self) -> float:
        """The clock of rank 0. Collective."""
        return float(self._sliding.block.surface.comm.bcast(self._clock()))

    def _stop(self, why: str) -> None:
        self._save()
        time, duration = self._sliding.current.time, self._duration
        raise SimulationStopped(
            f"the run stops at t = {1e3 * time:.4g} ms of {1e3 * duration:.4g} ms: {why}"
        )
