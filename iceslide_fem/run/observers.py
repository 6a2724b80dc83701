"""Who looks on while a block slides: each is called with t = 0 and with every accepted step.

All are collective. They change nothing of what they see.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from iceslide_fem.coupling.sliding import Accepted, Sliding
from iceslide_fem.output.fields import Fields
from iceslide_fem.output.history import interface_fields
from iceslide_fem.output.table import HistoryRow, Table
from iceslide_fem.run.checkpoint import write_checkpoint
from iceslide_fem.run.interruption import Interruption
from iceslide_fem.run.schedule import FieldTimes, Saves, Schedule


class Observation(NamedTuple):
    """The slide at its present moment, the step that led there (None at t = 0), and its row."""

    sliding: Sliding
    accepted: Accepted | None
    row: HistoryRow

    @property
    def time(self) -> float:
        """Sliding time, s."""
        return self.sliding.current.time

    @property
    def solved(self) -> bool:
        """Whether the block has been solved for this moment: else it is as it was."""
        return self.accepted is None or self.accepted.solved


class Observer(Protocol):
    """Whoever looks on."""

    def __call__(self, step: Observation, /) -> None:
        """Look at t = 0 or at an accepted step."""


class Stateful(Protocol):
    """What a checkpoint holds a part of."""

    def state(self) -> Any:
        """All that it needs to go on, in JSON values and arrays, on rank 0."""


class FieldSeries:
    """Writes `fields/` at the times that are due."""

    def __init__(
        self, folder: Path, sliding: Sliding, earlier: Sequence[Mapping[str, Any]]
    ) -> None:
        """`earlier` is the `state` of the run that goes on."""
        block, self._ice = sliding.block, sliding.carrier.ice
        temperature = self._ice.show(sliding.current.interface.ice)
        self.files = Fields(folder, block.rubber, block.surface, temperature, earlier)
        self._due = FieldTimes(block.scene.load.duration, sliding.current.time)

    def state(self) -> list[dict[str, Any]]:
        """Times and files written so far."""
        return self.files.written

    def __call__(self, step: Observation) -> None:
        """Write the fields if they are due."""
        if step.accepted is None or self._due(step.time):
            self._ice.show(step.sliding.current.interface.ice)
            self.files.write(step.time, interface_fields(step.sliding, step.accepted))


class Checkpoints:
    """Writes checkpoints when they are due; `save` writes one at once."""

    def __init__(
        self,
        folder: Path,
        sliding: Sliding,
        parts: Mapping[str, Stateful],
        history: Table,
        schedule: Schedule,
    ) -> None:
        """A checkpoint holds the states of `parts` by their names."""
        self._folder, self._scene, self._parts = folder, sliding.block.scene, parts
        self._history, self._comm = history, sliding.block.surface.comm
        self._due = Saves(schedule, sliding.current.time, self._comm)

    def __call__(self, step: Observation) -> None:
        """Save if it is due, and at t = 0."""
        if self._due(step.time) or step.accepted is None:
            self.save()

    def save(self) -> None:
        """Write a checkpoint of the present moment."""
        self._history.secure()
        present = {name: part.state() for name, part in self._parts.items()}
        if self._comm.rank == 0:
            write_checkpoint(self._folder, self._scene, present)


class Stops:
    """Ends a run that has been asked to stop, with a checkpoint of its last accepted step."""

    def __init__(
        self, sliding: Sliding, interruption: Interruption, checkpoints: Checkpoints, folder: Path
    ) -> None:
        self._sliding, self._interruption = sliding, interruption
        self._checkpoints, self._folder = checkpoints, folder

    def __call__(self, step: Observation) -> None:
        """Raise Interrupted if a signal has come."""
        self.heed()

    def heed(self) -> None:
        """The same between the trials of a step."""
        if self._interruption.requested():
            self._checkpoints.save()
            time, duration = self._sliding.current.time, self._sliding.block.scene.load.duration
            where = f"at t = {1e3 * time:.4g} ms of {1e3 * duration:.4g} ms"
            raise self._interruption.error(where, self._folder)
