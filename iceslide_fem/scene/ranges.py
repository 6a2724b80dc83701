"""Ranges that a user types, "first:last:count"."""

from __future__ import annotations

import math


def read_range(text: str) -> tuple[str, str, int]:
    """The ends and the count of "first:last:count".

    Raises ValueError if it has another form, or one value between two different ends: it is then
    more likely first:step:last.
    """
    try:
        first, last, count = (part.strip() for part in text.split(":"))
        number = int(count)
    except ValueError:
        raise ValueError("is not of the form first:last:count with a whole count") from None
    if number == 1 and first != last:
        raise ValueError(
            f"is one value from {first} to {last}, because a range is first:last:count; write "
            f'"{first}" for one value{_by_steps(first, last, number)}'
        )
    return first, last, number


def _by_steps(first: str, step: str, last: int) -> str:
    """The range that first:step:last means, as an alternative; "" if it means none."""
    try:
        steps = (last - float(first)) / float(step)
    except (ValueError, ZeroDivisionError):
        return ""
    if not (1.0 <= steps < math.inf and abs(steps - round(steps)) < 1e-6):
        return ""
    return f', or "{first}:{last}:{round(steps) + 1}" for {first} to {last} in steps of {step}'
