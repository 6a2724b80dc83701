"""Output of a run: quantities and times."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import field_validator

from iceslide_fem.scene.table import Name, Table
from iceslide_fem.scene.units import Quantity

Place = Annotated[float, Quantity("m", "-1 m", "1 m")]
FIELDS = Literal["rubber", "stress", "interface", "contact_points", "ice", "trail"]
MOST_TIMES = 10_000  # of fields, by their number


class Output(Table):
    """Output of a slice or block besides its histories. It does not change results.

    `times` of fields: a number of equal parts of the run, an interval (s), or a list (s). `fields`
    are those of docs/reference/columns.md. `probes`: named positions (x, y, z), m, in the
    undeformed rubber, on its contact surface (z = 0), or in the ice (z < 0).
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
        """The last of listed `times`, s; 0 without a list."""
        return max(self.times, default=0.0) if isinstance(self.times, tuple) else 0.0
