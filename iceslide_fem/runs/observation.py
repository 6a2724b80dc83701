"""Observations of a sliding block after each accepted step, and the protocol of observers."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep
from iceslide_fem.output.table import HistoryRow, of_pass


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
