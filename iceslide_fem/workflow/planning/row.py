"""One line of what `iceslide info` prints."""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """One line of the table: group, name, value with unit, and meaning."""

    group: str
    quantity: str
    value: str
    meaning: str
