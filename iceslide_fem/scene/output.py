"""What a run of a scene writes, and when."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import field_validator

from iceslide_fem.scene.table import Name, Table
from iceslide_fem.scene.units import Quantity

Place = Annotated[float, Quantity("m", "-1 m", "1 m")]
FIELDS = Literal["rubber", "stress", "interface", "contact_points", "ice", "trail"]
MOST_TIMES = 10_000  # of fields, by their number


class Output(Table):
    """What a slice or block writes beside its histories. None of it changes a result.

    `times` of the fields: how many parts of the run end with one (a whole number), or an interval
    or a list (s). `fields` are those of docs/reference/columns.md. `probes`: places (x, y, z), m,
    by their names: of the undeformed rubber, of its contact surface (z = 0), or of the ice (z < 0).
    """

    times: int | float | tuple[float, ...] = 25
    fields: tuple[FIELDS, ...] = ("rubber", "stress", "interface", "ice", "trail")
    probes: dict[Name, tuple[Place, Place, Place]] = {}

    @field_validator("times", mode="before")
    @classmethod
    def _number_interval_or_list(cls, times: Any) -> int | float | tuple[float, ...]:
        if isinstance(times, int) and not isinstance(times, bool):
            if not 0 <= times <= MOST_TIMES:
                raise ValueError(
                    f"output.times = {times} is out of range; allowed: 0 to {MOST_TIMES} times, an "
                    'interval ("0.1 ms"), or a list of times'
                )
            return times
        if isinstance(times, list | tuple):
            return tuple(sorted({Quantity("s", "0 s", "100 s").validate(time) for time in times}))
        return Quantity("s", "1 ns", "100 s").validate(times)

    @property
    def latest(self) -> float:
        """The last of the `times` that are listed, s; 0 if none is."""
        return max(self.times, default=0.0) if isinstance(self.times, tuple) else 0.0
