"""Quantities as users type them: plain numbers in SI, or strings with a unit."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, StringConstraints
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from iceslide_fem.runtime.units import to_si


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


Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$", strict=True)]


def key(default: Any, text: str, **more: Any) -> Any:
    """A key of a scene with its default (`...`: none) and its meaning, which the reference and the
    page take from here; more: as for pydantic's `Field`.
    """
    return Field(default, description=text, **more)


class Table(BaseModel):
    """A table of a scene: frozen, without unknown keys, hashable."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __hash__(self) -> int:
        return hash(self.model_dump_json())  # a table within may be a dictionary


@dataclass(frozen=True)
class Quantity:
    """Annotation of a pydantic float field: SI `unit` ("" for a pure number), and its range.

    `low` and `high` (both included) are written as a user types them, and shown in the error
    message: `pressure: Annotated[float, Quantity("Pa", "0.01 bar", "100 bar")]`.
    """

    unit: str
    low: str
    high: str

    def validate(self, value: Any) -> float:
        """`value` in SI; raises PydanticCustomError("quantity") with the fault and the range."""
        try:
            return self.in_range(value)
        except ValueError as error:
            low, high = (json.dumps(end) if self.unit else end for end in (self.low, self.high))
            message = f"{error}; allowed: {low} to {high}"
            raise PydanticCustomError("quantity", "{message}", {"message": message}) from None

    def in_range(self, value: Any) -> float:
        """`value` in SI; raises ValueError with the fault only."""
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError("is not a number" + (" or a string with a unit" if self.unit else ""))
        number = to_si(value, self.unit) if isinstance(value, str) else value
        if not to_si(self.low, self.unit) <= number <= to_si(self.high, self.unit):
            plain = self.unit and not isinstance(value, str)
            meant = f" (a plain number is in {self.unit})" if plain else ""
            raise ValueError(f"is out of range{meant}")
        return float(number)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.validate, handler(source))
