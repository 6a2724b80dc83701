"""A slider of the page: the range it covers, and the unit its text is in."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array


class Slider(NamedTuple):
    """Slider of the field `key`, from `low` to `high` in `unit`; `start` is where it stands first.

    SI = `scale` x value + `shift`; log: on a logarithmic scale. A text may leave the slider's
    range, within that of the key itself.
    """

    key: str
    label: str
    unit: str
    scale: float
    low: float
    high: float
    start: float
    log: bool = True
    shift: float = 0.0

    def text(self, value: float) -> str:
        """`value`, in the slider's unit, as one would type it."""
        return f"{value:g} {self.unit}".strip()

    def si(self, value: Array) -> Array:
        """`value` in SI."""
        return self.scale * value + self.shift

    def values(self, count: int) -> Array:
        """`count` values over the whole range, in the slider's unit."""
        space = np.geomspace if self.log else np.linspace
        return np.asarray(space(self.low, self.high, count))

    def described(self) -> dict[str, Any]:
        """What the page needs to draw it."""
        return self._asdict() | {"text": self.text(self.start)}
