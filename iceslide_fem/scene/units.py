"""Quantities as users type them: plain numbers in SI, or strings with a unit."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from iceslide_fem.runtime.units import to_si


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
