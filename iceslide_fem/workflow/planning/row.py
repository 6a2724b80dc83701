"""One line of what `iceslide info` prints."""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """One line of the table: the group it stands in, name, value with unit, and its meaning."""

    group: str
    quantity: str
    value: str
    meaning: str
