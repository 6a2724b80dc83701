"""What is seen of a sliding block after each accepted step, and by whom."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep
from iceslide_fem.output.passes import of_pass
from iceslide_fem.output.table import HistoryRow


class Observation(NamedTuple):
    """The slide at its present moment, the step that led there (None at t = 0), and its row."""

    sliding: Sliding
    accepted: AcceptedStep | None
    row: HistoryRow

    @property
    def time(self) -> float:
        """Sliding time of all passes, s."""
        return self.sliding.current.time

    @property
    def history_row(self) -> HistoryRow:
        """The row of `history.csv`: of several passes it says which, and its time counts rests."""
        load, number = self.sliding.block.scene.load, self.sliding.number
        if load.passes == 1:
            return self.row
        return of_pass(self.row, number, (number - 1) * load.rest)

    @property
    def solved(self) -> bool:
        """Whether the block has been solved for this moment: else it is as it was."""
        return self.accepted is None or self.accepted.solved


class Observer(Protocol):
    """Whoever looks on."""

    def __call__(self, step: Observation, /) -> None:
        """Look at t = 0 or at an accepted step."""
